"""Brings a database to the shape that this version of Galley knows, or says why it cannot."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, inspect, text
from sqlalchemy.exc import DatabaseError

from galley.errors import GalleyError
from galley.records.lock import ServingLock

SCRIPTS = Path(__file__).parent / "migrations"
# Any number that nothing else in the database locks; replicas that start together take turns.
ADVISORY_LOCK = 7_405_926_117


def migrate(engine: Engine, name: str, file: Path | None, *, locked: bool, scripts: Path = SCRIPTS) -> None:
    """Run every migration that is still missing, all in one transaction.

    `name` is what messages call the database, `file` its SQLite file, `locked` whether it is locked already.
    Raises: GalleyError if the database is newer than this Galley, is not Galley's, or is being served.
    """
    config = Config()
    config.set_main_option("script_location", str(scripts).replace("%", "%%"))
    directory = ScriptDirectory.from_config(config)
    try:
        with engine.connect() as connection:
            if _is_current(connection, name, directory):
                return
        if file is None or locked:
            _upgrade(engine, name, directory, config)
        else:
            with ServingLock(file):
                _upgrade(engine, name, directory, config)
    except DatabaseError as error:
        raise GalleyError(f"{name}: cannot be opened as records: {error.orig}") from None


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
