"""When the database fails: nothing is lost in silence, and the writer lives on."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from sqlalchemy.exc import OperationalError

from galley.errors import GalleyError
from galley.records import Store, TickRow
from galley.records.database import engine
from tests.records.helpers import START_MS, begin, joint_actions, one_soup, open_round, play, tick_rows
from tests.records.stored import stored_trajectory, stored_visit


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "galley.sqlite"


@pytest.fixture
def impatient(file: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    """A store that gives up soon on a database that somebody else has locked."""
    monkeypatch.setattr(engine, "BUSY_MS", 20)
    with Store.open(file, flush_every_s=0.05) as store:
        yield store


@contextmanager
def locked(file: Path) -> Iterator[None]:
    """Another program writes to the file and does not finish."""
    connection = sqlite3.connect(file, isolation_level=None)
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
    finally:
        connection.execute("ROLLBACK")
        connection.close()


def wait_until(holds: Callable[[], bool]) -> None:
    patience = time.monotonic() + 20
    while not holds():
        assert time.monotonic() < patience, "waited in vain"
        time.sleep(0.01)


def test_the_journal_is_tried_again_until_it_is_written(impatient: Store, file: Path) -> None:
    visit = begin(impatient)
    round_id = open_round(impatient, visit)
    actions = joint_actions(1, 20)
    with locked(file):
        impatient.journal(round_id, tick_rows(actions[:10]))
        wait_until(lambda: not impatient.health().ok)
        impatient.journal(round_id, tick_rows(actions[10:], 10))
        with pytest.raises(GalleyError, match="locked"):
            impatient.flush().result()
        health = impatient.health()
        assert "locked" in health.message
        assert (health.waiting_rows, health.lost_rows) == (20, 0)
    wait_until(lambda: impatient.health().ok)
    assert impatient.health().waiting_rows == 0
    row = impatient.open_round(visit.id, "rounds-1").result()
    assert row is not None
    assert row.joint_actions.tolist() == [list(pair) for pair in actions]


def test_an_answer_that_cannot_be_stored_is_not_acknowledged(impatient: Store, file: Path) -> None:
    visit = begin(impatient)
    with locked(file):
        failed = impatient.save_answers(visit.id, "survey", {"ease": 5}, 1, "active", START_MS)
        with pytest.raises(OperationalError, match="locked"):
            failed.result()
        assert not impatient.health().ok
    assert impatient.save_answers(visit.id, "survey", {"ease": 5}, 1, "active", START_MS).result() is True
    assert impatient.health().ok


def test_a_round_that_cannot_be_finished_keeps_its_journal(impatient: Store, file: Path) -> None:
    visit = begin(impatient)
    round_id = open_round(impatient, visit)
    with locked(file):
        impatient.journal(round_id, tick_rows(joint_actions(1, 10)))
        with pytest.raises(GalleyError, match="locked"):
            impatient.finish_round(round_id, "abandoned", 0, 0, START_MS, b"").result()
        assert impatient.health().waiting_rows == 10
    assert impatient.finish_round(round_id, "abandoned", 0, 0, START_MS, b"").result() is True
    assert len(stored_trajectory(impatient, round_id).joint_actions) == 10


def test_a_row_the_database_refuses_is_told_and_harms_no_other_round(impatient: Store) -> None:
    visit, other = begin(impatient), begin(impatient)
    bad, good = open_round(impatient, visit), open_round(impatient, other)
    broken = TickRow(0, 4, None, 0.0, 0.0, None, False)  # type: ignore[arg-type]
    impatient.journal(bad, [broken])
    impatient.journal(good, tick_rows(joint_actions(1, 3)))
    impatient.journal(999, tick_rows(joint_actions(1, 2)))
    impatient.flush().result()
    health = impatient.health()
    assert not health.ok
    assert (health.waiting_rows, health.lost_rows) == (0, 3)
    assert "3 journal rows were refused" in health.message
    assert len(stored_trajectory(impatient, good).joint_actions) == 3
    play(impatient, bad, one_soup())
    assert not impatient.health().ok, "what was lost stays told"


def test_closing_says_what_could_not_be_written(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "BUSY_MS", 20)
    store = Store.open(file, serving=True, flush_every_s=0.05)
    round_id = open_round(store, begin(store))
    with locked(file):
        store.journal(round_id, tick_rows(joint_actions(1, 3)))
        with pytest.raises(GalleyError, match="3 journal rows could not be written: database is locked"):
            store.close()
    Store.open(file, serving=True).close()


def test_a_job_that_raises_leaves_nothing_behind(impatient: Store) -> None:
    visit = begin(impatient)
    bad = impatient.save_answers(visit.id, "survey", {"ease": {1, 2}}, 1, "active", START_MS)
    with pytest.raises(Exception, match="not JSON serializable"):
        bad.result()
    after = stored_visit(impatient, visit.token)
    assert after is not None
    assert after.step_index == 0
    assert impatient.save_answers(visit.id, "survey", {"ease": 1}, 1, "active", START_MS).result() is True
