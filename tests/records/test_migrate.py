"""Old databases are brought forward with their data; newer ones are refused."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from galley.errors import GalleyError
from galley.records import Store, migrate
from galley.records.engine import connect, database_url
from galley.records.export import export_study
from galley.records.tables import METADATA
from galley.records.verify import verify_study
from tests.records.helpers import begin, one_soup, open_round, play

# As the first revision wrote it; never to be changed. Made by `sqlite3 galley.sqlite .dump`.
FIRST = Path(__file__).with_name("first_revision.sql")

NEXT = """
import sqlalchemy as sa
from alembic import op

revision = "next"
down_revision = "{head}"


def upgrade() -> None:
    with op.batch_alter_table("visits") as visits:
        visits.add_column(sa.Column("note", sa.Text(), nullable=False, server_default="none"))
        visits.alter_column("status", type_=sa.String(30))
    {more}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "galley.sqlite"


@pytest.fixture
def scripts(tmp_path: Path) -> Path:
    """A copy of the migrations, to add to."""
    return Path(shutil.copytree(migrate.SCRIPTS, tmp_path / "migrations"))


def with_a_next_revision(scripts: Path, more: str = "") -> None:
    head = sorted(path.stem.split("_")[0] for path in (scripts / "versions").glob("[0-9]*.py"))[-1]
    (scripts / "versions" / "next.py").write_text(NEXT.format(head=head, more=more))


def played(file: Path) -> None:
    """A database with a visit, an answer and a whole round in it."""
    with Store.open(file) as store:
        visit = begin(store)
        play(store, open_round(store, visit), one_soup())
        store.save_answers(visit.id, "consent", {"why": "=1+1"}, 1, "active", 1).result()


def run(file: Path, scripts: Path) -> None:
    migrate.migrate(database_url(file), locked=False, scripts=scripts)


def rows(file: Path, query: str) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(file)) as connection:
        return connection.execute(query).fetchall()


def test_the_migrations_make_the_tables_that_the_code_knows(file: Path) -> None:
    Store.open(file).close()
    database = connect(database_url(file), writes=False)
    with database.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, METADATA) == []
    database.dispose()
    clustered = "SELECT name FROM sqlite_master WHERE sql LIKE '%WITHOUT ROWID%' ORDER BY name"
    assert rows(file, clustered) == [("clocks",), ("keys",), ("pauses",), ("ticks",)]


def test_a_database_of_the_first_revision_is_brought_forward_with_its_data(
    file: Path, tmp_path: Path
) -> None:
    with closing(sqlite3.connect(file)) as connection:
        connection.executescript(FIRST.read_text(encoding="utf-8"))
    with Store.open(file) as store:
        report = verify_study(store, "demo")
        assert report.ok, str(report)
        assert (report.rounds, report.ticks, report.open) == (2, 49, 1)
        export_study(store, "demo", tmp_path / "out")
        assert begin(store).visit_no == 2
    assert "'=1+1" in (tmp_path / "out" / "responses.csv").read_text(encoding="utf-8")


def test_a_migration_keeps_the_data_and_what_points_at_it(file: Path, scripts: Path) -> None:
    played(file)
    before = [rows(file, f"SELECT * FROM {table}") for table in ("ticks", "responses", "seats")]
    with_a_next_revision(scripts)
    run(file, scripts)
    assert rows(file, "SELECT participant IS NOT NULL, note, status FROM visits") == [(1, "none", "active")]
    assert [rows(file, f"SELECT * FROM {table}") for table in ("ticks", "responses", "seats")] == before
    assert rows(file, "PRAGMA foreign_key_check") == []
    assert rows(file, "SELECT version_num FROM alembic_version") == [("next",)]


def test_a_migration_that_fails_changes_nothing(file: Path, scripts: Path) -> None:
    played(file)
    before = rows(file, "SELECT * FROM sqlite_master ORDER BY name")
    with_a_next_revision(scripts, "op.execute('SELECT * FROM nowhere')")
    with pytest.raises(GalleyError, match="no such table: nowhere"):
        run(file, scripts)
    assert rows(file, "SELECT * FROM sqlite_master ORDER BY name") == before
    assert rows(file, "SELECT count(*) FROM ticks") == [(40,)]


def test_a_database_newer_than_the_code_is_refused(file: Path, scripts: Path) -> None:
    played(file)
    with_a_next_revision(scripts)
    run(file, scripts)
    for serving in (False, True):
        with pytest.raises(GalleyError, match=r"newer Galley \(revision next\)") as caught:
            Store.open(file, serving=serving)
        assert "\n" not in str(caught.value)


def test_a_database_is_not_migrated_while_it_is_served(file: Path, scripts: Path) -> None:
    with_a_next_revision(scripts)
    with Store.open(file, serving=True), pytest.raises(GalleyError, match="already serves"):
        run(file, scripts)
    run(file, scripts)


def test_a_migration_that_loses_what_others_point_at_is_undone(file: Path, scripts: Path) -> None:
    played(file)
    with_a_next_revision(scripts, "op.execute('DELETE FROM visits')")
    with pytest.raises(GalleyError, match="rows of responses seats stages that point nowhere"):
        run(file, scripts)
    assert rows(file, "SELECT count(*) FROM visits") == [(1,)]
