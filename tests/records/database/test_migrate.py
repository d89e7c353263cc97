"""Old databases are brought forward with their data; newer ones are refused."""

from __future__ import annotations

import csv
import json
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import MetaData, insert, text

from galley.errors import GalleyError
from galley.records import Store
from galley.records.database import migrate
from galley.records.database.engine import connect, database_url
from galley.records.database.tables import METADATA
from galley.records.export.study_export import export_study
from galley.records.reading.flags import flags
from galley.records.reading.verify import verify_study
from galley.study.stages.stage_kinds import QuizStep
from tests.postgres import Postgres
from tests.records import databases
from tests.records.databases import Database
from tests.records.helpers import begin, one_soup, open_round, plan, play
from tests.records.stored import stored_visit
from tests.study.written.test_questionnaire import made

# As the first revision wrote it; never to be changed. Made by `sqlite3 galley.sqlite .dump`.
FIRST = Path(__file__).with_name("first_revision.sql")

NEXT = """
import sqlalchemy as sa
from alembic import op

revision = "next"
down_revision = "{head}"


def upgrade() -> None:
    with op.batch_alter_table("visits") as visits:
        visits.add_column(sa.Column("remark", sa.Text(), nullable=False, server_default="none"))
        visits.alter_column("status", type_=sa.String(30))
    {more}
"""


@pytest.fixture(params=["sqlite", "postgresql"])
def empty(request: pytest.FixtureRequest, tmp_path: Path) -> Database:
    """A database without any table."""
    if request.param == "sqlite":
        (tmp_path / "deep").mkdir()
        return databases.sqlite(tmp_path)
    return databases.empty_postgresql(request.getfixturevalue("postgresql_server"))


@pytest.fixture
def old(empty: Database, tmp_path: Path) -> Iterator[Database]:
    """A database of the first revision with visits and rounds in it."""
    source = tmp_path / "first.sqlite"
    with closing(sqlite3.connect(source)) as connection:
        connection.executescript(FIRST.read_text(encoding="utf-8"))
    if empty.kind == "sqlite":
        shutil.copy(source, empty.url)
    else:
        _copy(source, empty)
    return empty


def _copy(source: Path, target: Database) -> None:
    """The first revision made by its migration, filled with the rows of an SQLite file."""
    config = Config()
    config.set_main_option("script_location", str(migrate.SCRIPTS))
    engine = connect(database_url(target.url), writes=True, migrates=True)
    with closing(sqlite3.connect(source)) as rows, engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "0001")
        tables = MetaData()
        tables.reflect(connection)
        for table in tables.sorted_tables:
            if table.name == "alembic_version":
                continue
            names = ", ".join(column.name for column in table.columns)
            cursor = rows.execute(f"SELECT {names} FROM {table.name}")
            kinds = [column.type.python_type for column in table.columns]
            found = [
                {
                    column.name: value if value is None else kind(value)
                    for column, kind, value in zip(table.columns, kinds, row, strict=True)
                }
                for row in cursor
            ]
            if found:
                connection.execute(insert(table), found)
        for name in ("visits", "rounds"):
            top = f"SELECT setval(pg_get_serial_sequence('{name}', 'id'), (SELECT max(id) FROM {name}))"
            connection.execute(text(top))
    engine.dispose()


@pytest.fixture
def scripts(tmp_path: Path) -> Path:
    """A copy of the migrations, to add to."""
    return Path(shutil.copytree(migrate.SCRIPTS, tmp_path / "migrations"))


def with_a_next_revision(scripts: Path, more: str = "") -> None:
    head = sorted(path.stem.split("_")[0] for path in (scripts / "versions").glob("[0-9]*.py"))[-1]
    (scripts / "versions" / "next.py").write_text(NEXT.format(head=head, more=more))


def played(database: Database) -> None:
    """A database with a visit, an answer and a whole round in it."""
    with Store.open(database.url) as store:
        visit = begin(store)
        play(store, open_round(store, visit), one_soup())
        store.save_answers(visit.id, "consent", {"why": "=1+1"}, 1, "active", 1).result()


def run(database: Database, scripts: Path) -> None:
    migrate.migrate(database_url(database.url), locked=False, scripts=scripts)


def content(database: Database, *names: str) -> list[list[tuple[Any, ...]]]:
    """All rows of some tables, in any order."""
    return [sorted(database.rows(f"SELECT * FROM {name}"), key=repr) for name in names]


def test_the_migrations_make_the_tables_that_the_code_knows(empty: Database) -> None:
    Store.open(empty.url).close()
    engine = connect(database_url(empty.url), writes=False)
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, METADATA) == []
    engine.dispose()


def test_sqlite_clusters_the_journal_and_numbers_no_row_twice(tmp_path: Path) -> None:
    database = databases.sqlite(tmp_path)
    Store.open(database.url).close()
    clustered = "SELECT name FROM sqlite_master WHERE sql LIKE '%WITHOUT ROWID%' ORDER BY name"
    assert database.rows(clustered) == [("clocks",), ("keys",), ("pauses",), ("ticks",)]
    numbered = "SELECT name FROM sqlite_master WHERE sql LIKE '%AUTOINCREMENT%' ORDER BY name"
    assert database.rows(numbered) == [("researchers",), ("rounds",), ("visits",)]


def test_a_database_of_the_first_revision_is_brought_forward_with_its_data(
    old: Database, tmp_path: Path
) -> None:
    ticks = content(old, "ticks", "keys", "pauses", "clocks", "stages")
    most = old.rows("SELECT max(id) FROM visits")[0][0]
    with Store.open(old.url) as store:
        report = verify_study(store, "demo")
        assert report.ok, str(report)
        assert (report.rounds, report.ticks, report.open) == (2, 49, 1)
        export_study(store, "demo", tmp_path / "out")
        assert content(old, "ticks", "keys", "pauses", "clocks", "stages") == ticks
        visit = begin(store)
        assert (visit.visit_no, visit.id > most) == (2, True)
        assert stored_visit(store, visit.token) == visit
    assert "'=1+1" in (tmp_path / "out" / "responses.csv").read_text(encoding="utf-8")
    counted = old.rows("SELECT status, played_ticks, late_ticks, fault_ticks FROM rounds ORDER BY id")
    assert counted == [("finished", 40, 0, 0), ("open", None, None, None)]
    assert old.rows("SELECT state FROM studies") == [("open",)]
    assert ("rounds-1", "") in old.rows("SELECT step_id, item FROM questions")
    assert old.rows("SELECT count(*) FROM visits WHERE last_seen_ms = 0") == [(0,)]


TWO = [{"value": value, "label": value} for value in ("a", "c")]
SCALE = {"kind": "likert", "low_label": "low", "high_label": "high"}
ASKED = made(
    {"kind": "multiple_choice", "options": TWO, "expected": ["c", "a"]},
    {"kind": "single_choice", "options": TWO, "expected": "c"},
    {**SCALE, "subscale": "trust"},
    {**SCALE, "subscale": "trust", "reversed": True},
)


def test_right_answers_that_were_kept_as_wrong_are_mended(empty: Database, tmp_path: Path) -> None:
    expected = dict(ASKED.expected)
    steps = [step if step.id != "debrief" else quiz(expected) for step in plan().steps]
    with Store.open(empty.url) as store:
        visit = begin(store)
        answers = {"q0": ["a", "c"], "q1": "a", "q2": 6, "q3": 2}
        for at, step in enumerate(("rounds-1-questions", "comparison"), 1):
            saved = store.save_answers(visit.id, step, answers, at, "active", 1, questionnaire=ASKED)
            assert saved.result()
        store.save_attempt(visit.id, "debrief", 1, answers, 2, ASKED).result()
    as_before = [
        "UPDATE responses SET passed = false WHERE item = 'q0' AND step_id = 'comparison'",
        'UPDATE attempts SET wrong = \'["q0", "q1"]\'',
        "DELETE FROM questions WHERE item LIKE 'subscale.%'",
        "DROP TABLE erasures",
        "UPDATE alembic_version SET version_num = '0004'",
    ]
    engine = connect(database_url(empty.url), writes=True)
    with engine.begin() as connection:
        for change in as_before:
            connection.execute(text(change))
        written = json.dumps({**json.loads(plan().to_json()), "steps": [step.stored() for step in steps]})
        connection.execute(text("UPDATE visits SET plan_json = :plan"), {"plan": written})
    engine.dispose()
    with Store.open(empty.url) as store:
        with store.reading() as connection:
            assert [flag.words for flag in flags(connection, "demo")[visit.id]] == ["2 checks failed"]
        export_study(store, "demo", tmp_path / "out")
    passed = empty.rows("SELECT item, passed FROM responses ORDER BY step_id, item")
    assert passed == [("q0", True), ("q1", False), ("q2", None), ("q3", None)] * 2
    assert empty.rows("SELECT wrong FROM attempts") == [('["q1"]',)]
    with (tmp_path / "out" / "wide.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["rounds-1-questions.subscale.trust"], row["comparison.subscale.trust"]) == ("6", "6")


def quiz(expected: dict[str, Any]) -> QuizStep:
    """A quiz as a plan held it."""
    return QuizStep(
        id="debrief", title="Quiz", questionnaire="quiz", expected=expected, tries=2, after_last="go_on"
    )


def test_a_migration_keeps_the_data_and_what_points_at_it(empty: Database, scripts: Path) -> None:
    played(empty)
    before = content(empty, "ticks", "responses", "seats")
    with_a_next_revision(scripts)
    run(empty, scripts)
    visits = empty.rows("SELECT participant IS NOT NULL, remark, status FROM visits")
    assert visits == [(True, "none", "active")]
    assert content(empty, "ticks", "responses", "seats") == before
    if empty.kind == "sqlite":
        assert empty.rows("PRAGMA foreign_key_check") == []
    assert empty.rows("SELECT version_num FROM alembic_version") == [("next",)]


def test_a_migration_that_fails_changes_nothing(empty: Database, scripts: Path) -> None:
    played(empty)
    columns = "SELECT * FROM visits LIMIT 1"
    before = empty.rows(columns)
    with_a_next_revision(scripts, "op.execute('SELECT * FROM nowhere')")
    with pytest.raises(GalleyError, match="nowhere"):
        run(empty, scripts)
    assert empty.rows(columns) == before
    assert empty.rows("SELECT count(*) FROM ticks") == [(40,)]


def test_a_database_newer_than_the_code_is_refused(empty: Database, scripts: Path) -> None:
    played(empty)
    with_a_next_revision(scripts)
    run(empty, scripts)
    for serving in (False, True):
        with pytest.raises(GalleyError, match=r"newer Galley \(revision next\)") as caught:
            Store.open(empty.url, serving=serving)
        assert "\n" not in str(caught.value)


def test_a_file_is_not_migrated_while_it_is_served(tmp_path: Path, scripts: Path) -> None:
    database = databases.sqlite(tmp_path)
    with_a_next_revision(scripts)
    with Store.open(database.url, serving=True), pytest.raises(GalleyError, match="already serves"):
        run(database, scripts)
    run(database, scripts)


def test_a_migration_that_loses_what_others_point_at_is_undone(empty: Database, scripts: Path) -> None:
    played(empty)
    with_a_next_revision(scripts, "op.execute('DELETE FROM seats'); op.execute('DELETE FROM studies')")
    words = "point nowhere" if empty.kind == "sqlite" else "violates foreign key"
    with pytest.raises(GalleyError, match=words):
        run(empty, scripts)
    assert empty.rows("SELECT count(*) FROM visits") == [(1,)]


def test_servers_that_start_together_migrate_once(postgresql_server: Postgres) -> None:
    from concurrent.futures import ThreadPoolExecutor

    database = databases.empty_postgresql(postgresql_server)
    with ThreadPoolExecutor(4) as pool:
        stores = list(pool.map(Store.open, [database.url] * 4))
    for store in stores:
        store.close()
    assert database.rows("SELECT count(*) FROM alembic_version") == [(1,)]
