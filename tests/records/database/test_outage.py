"""A PostgreSQL server that goes away in the middle of rounds and comes back: nothing is lost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest

from galley.errors import GalleyError
from galley.records import Store
from galley.records.database import writer as writer_module
from galley.records.store import queries
from tests import postgres
from tests.records import databases
from tests.records.helpers import START_MS, begin, joint_actions, open_round, tick_rows
from tests.records.stored import stored_trajectory, stored_visit


@pytest.fixture(scope="module")
def server() -> Iterator[postgres.Postgres]:
    """A server of its own, since it is stopped."""
    with postgres.running() as started:
        yield started


@pytest.fixture
def url(server: postgres.Postgres) -> str:
    return databases.postgresql(server).url


def wait_until(holds: Callable[[], bool]) -> None:
    patience = time.monotonic() + 20
    while not holds():
        assert time.monotonic() < patience, "waited in vain"
        time.sleep(0.01)


@pytest.mark.parametrize("how", ["fast", "immediate"])
def test_rounds_go_on_while_the_database_restarts(server: postgres.Postgres, url: str, how: str) -> None:
    with Store.open(url, serving=True, flush_every_s=0.05) as store:
        visit = begin(store)
        round_id = open_round(store, visit)
        lease = store.lease_round(round_id, "a", 600).result()
        assert lease is not None
        actions = joint_actions(1, 40)
        store.journal(round_id, tick_rows(actions[:10]), lease=lease)
        store.flush().result()
        server.stop(how)
        try:
            store.journal(round_id, tick_rows(actions[10:30], 10), lease=lease)
            wait_until(lambda: not store.health().ok)
            answered = store.save_answers(visit.id, "survey", {"ease": 5}, 1, "active", START_MS)
            found = store.read(lambda connection: queries.visit(connection, visit.token))
            health = store.health()
            assert (health.waiting_rows, health.lost_rows) == (20, 0)
            assert health.message
            assert not answered.done()
        finally:
            server.start()
        assert answered.result() is True
        assert found.result() is not None
        store.journal(round_id, tick_rows(actions[30:], 30), lease=lease)
        assert store.finish_round(round_id, "abandoned", 0, 0, START_MS, b"", lease=lease).result() is True
        assert store.health().ok
        assert not lease.lost
        assert stored_trajectory(store, round_id).joint_actions.tolist() == [list(pair) for pair in actions]


def test_who_waits_too_long_is_told_so_and_the_journal_is_kept(server: postgres.Postgres, url: str) -> None:
    with Store.open(url, flush_every_s=0.05, retry_for_s=0.3) as store:
        visit = begin(store)
        round_id = open_round(store, visit)
        server.stop()
        try:
            store.journal(round_id, tick_rows(joint_actions(1, 5)))
            failed = store.save_answers(visit.id, "survey", {"ease": 5}, 1, "active", START_MS)
            with pytest.raises(GalleyError, match=r"records cannot be reached: .") as caught:
                failed.result()
            assert "\n" not in str(caught.value)
            with pytest.raises(GalleyError, match="cannot be reached"):
                stored_visit(store, visit.token)
            with pytest.raises(GalleyError, match="cannot be written"):
                store.finish_round(round_id, "abandoned", 0, 0, START_MS, b"").result()
            assert store.health().waiting_rows == 5
            with pytest.raises(GalleyError, match="cannot be opened as records") as refused:
                Store.open(url)
            assert "\n" not in str(refused.value)
        finally:
            server.start()
        wait_until(lambda: store.health().ok)
        assert store.health().waiting_rows == 0
        assert len(stored_trajectory(store, round_id).joint_actions) == 5


def test_what_waits_is_bounded_and_what_is_dropped_is_told(
    server: postgres.Postgres, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer_module, "MOST_WAITING_ROWS", 12)
    with Store.open(url, flush_every_s=600) as store:
        round_id = open_round(store, begin(store))
        rows = tick_rows(joint_actions(1, 20))
        for row in rows:
            store.journal(round_id, [row])
        health = store.health()
        assert (health.ok, health.waiting_rows, health.lost_rows) == (False, 12, 8)
        assert "more than 12 were waiting" in health.message
    with Store.open(url) as store:
        assert len(stored_trajectory(store, round_id).joint_actions) == 12


def test_closing_does_not_wait_for_a_database_that_is_away(server: postgres.Postgres, url: str) -> None:
    store = Store.open(url, flush_every_s=0.05)
    visit = begin(store)
    round_id = open_round(store, visit)
    server.stop()
    try:
        store.journal(round_id, tick_rows(joint_actions(1, 3)))
        answered = store.save_answers(visit.id, "survey", {"ease": 5}, 1, "active", START_MS)
        with pytest.raises(GalleyError, match="3 journal rows could not be written"):
            store.close()
        with pytest.raises(GalleyError, match="cannot be reached"):
            answered.result()
    finally:
        server.start()
