"""Brings a database to the shape that this version of Galley knows, or says why it cannot."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, inspect, text
from sqlalchemy.engine import URL
from sqlalchemy.exc import DatabaseError

from galley.errors import GalleyError
from galley.records.database.engine import connect, shown, sqlite_file
from galley.records.database.retries import one_line
from galley.records.database.serving_lock import serving_lock

SCRIPTS = Path(__file__).parent / "migrations"
# Any number that nothing else in the database locks; replicas that start together take turns.
ADVISORY_LOCK = 7_405_926_117


def migrate(url: URL, *, locked: bool, scripts: Path = SCRIPTS) -> None:
    """Run every migration that is still missing, all in one transaction.

    `locked` tells whether the serving lock of an SQLite file is held already.

    Raises:
        GalleyError: the database is newer than this Galley, is not Galley's, or is being served.
    """
    config = Config()
    config.set_main_option("script_location", str(scripts).replace("%", "%%"))
    directory = ScriptDirectory.from_config(config)
    file = sqlite_file(url)
    engine = connect(url, writes=True, migrates=True)
    try:
        with engine.connect() as connection:
            if _is_current(connection, shown(url), directory):
                return
        with serving_lock(file) if file is not None and not locked else nullcontext():
            _upgrade(engine, shown(url), directory, config)
    except DatabaseError as error:
        fix = "name another with --database"
        if "readonly" in one_line(error):
            fix = f"let this account write it and its folder, or {fix}"
        raise GalleyError(f"{shown(url)}: cannot be opened as records: {one_line(error)}; {fix}") from None
    finally:
        engine.dispose()


def _is_current(connection: Connection, name: str, directory: ScriptDirectory) -> bool:
    heads = MigrationContext.configure(connection).get_current_heads()
    known = {script.revision for script in directory.walk_revisions()}
    for head in heads:
        if head not in known:
            raise GalleyError(f"{name}: was written by a newer Galley (revision {head}); upgrade this one")
    if not heads and inspect(connection).get_table_names():
        raise GalleyError(f"{name}: holds tables that are not Galley's; use another with --database")
    return set(heads) == set(directory.get_heads())


def _upgrade(engine: Engine, name: str, directory: ScriptDirectory, config: Config) -> None:
    with engine.begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": ADVISORY_LOCK})
        if not _is_current(connection, name, directory):  # another process may have been first
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
        if connection.dialect.name == "sqlite" and (broken := _pointing_nowhere(connection)):
            raise GalleyError(f"{name}: migrating it would leave rows of {broken} that point nowhere")


def _pointing_nowhere(connection: Connection) -> str:
    return " ".join(sorted({row[0] for row in connection.exec_driver_sql("PRAGMA foreign_key_check")}))
