"""Rounds belong to one serving process at a time, and what another writes of them is dropped."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest

from galley.errors import GalleyError
from galley.records import ClockRow, KeyRow, Lease, LeaseLost, Store
from galley.records.reading.overdue import wall_time
from tests.postgres import Postgres
from tests.records import databases
from tests.records.helpers import START_MS, begin, joint_actions, one_soup, open_round, tick_rows
from tests.records.stored import stored_trajectory, stored_visit

LONG_S = 600.0


@pytest.fixture
def pair(postgresql_server: Postgres) -> Iterator[tuple[Store, Store]]:
    """Two servers on one database."""
    url = databases.postgresql(postgresql_server).url
    often = 0.05
    with (
        Store.open(url, serving=True, flush_every_s=often) as one,
        Store.open(url, serving=True, flush_every_s=often) as two,
    ):
        yield one, two


def taken(store: Store, round_id: int, owner: str, ttl_s: float = LONG_S, steal: bool = False) -> Lease:
    lease = store.lease_round(round_id, owner, ttl_s, steal).result()
    assert lease is not None
    return lease


def wait_until(holds: Callable[[], bool]) -> None:
    patience = time.monotonic() + 20
    while not holds():
        assert time.monotonic() < patience, "waited in vain"
        time.sleep(0.01)


def test_one_owner_at_a_time(store: Store) -> None:
    round_id = open_round(store, begin(store))
    first = taken(store, round_id, "a")
    assert (first.number, first.lost) == (1, False)
    assert store.lease_round(round_id, "b", LONG_S).result() is None
    assert store.release(first).result() is True
    assert taken(store, round_id, "b").number == 2
    assert store.release(first).result() is False
    with pytest.raises(GalleyError, match="no round 99"):
        store.lease_round(99, "a", LONG_S).result()


def test_a_round_is_played_and_finished_under_a_lease(store: Store) -> None:
    visit = begin(store)
    round_id = open_round(store, visit)
    lease = taken(store, round_id, "a")
    store.journal(round_id, tick_rows(joint_actions(1, 7)), lease=lease)
    assert store.finish_round(round_id, "abandoned", 0, 0, START_MS, b"", lease=lease).result() is True
    assert len(stored_trajectory(store, round_id).joint_actions) == 7
    assert taken(store, round_id, "b").number == 2, "finishing lets go"
    assert store.health().fenced_rows == 0


def test_an_owner_that_dies_is_followed_once_its_lease_ran_out(pair: tuple[Store, Store]) -> None:
    one, two = pair
    visit = begin(one)
    round_id = open_round(one, visit)
    lease = taken(one, round_id, "a", ttl_s=0.5)
    one.journal(round_id, tick_rows(joint_actions(1, 7)), lease=lease)
    one.flush().result()
    time.sleep(1.2)
    assert two.lease_round(round_id, "b", LONG_S).result() is None, "the owner lives and renews"
    one._writer.let_go(lease)  # as if it had died
    wait_until(lambda: two.lease_round(round_id, "b", LONG_S).result() is not None)
    row = two.open_round(visit.id, "rounds-1").result()
    assert row is not None
    assert row.joint_actions.tolist() == [list(pair) for pair in joint_actions(1, 7)]


def test_what_the_last_owner_still_writes_is_dropped(pair: tuple[Store, Store]) -> None:
    one, two = pair
    visit = begin(one)
    round_id, other = open_round(one, visit), open_round(one, visit, "rounds-2")
    old, kept = taken(one, round_id, "a"), taken(one, other, "a")
    one.journal(round_id, tick_rows(joint_actions(1, 5)), lease=old)
    one.flush().result()
    new = taken(two, round_id, "b", steal=True)
    one.journal(round_id, tick_rows(joint_actions(2, 3), 5), lease=old)
    one.journal(other, tick_rows(joint_actions(3, 4)), lease=kept)
    one.flush().result()
    assert (old.lost, kept.lost, new.lost) == (True, False, False)
    health = one.health()
    assert (health.ok, health.fenced_rows, health.lost_rows) == (True, 3, 0)
    two.journal(round_id, tick_rows(one_soup()[5:], 5), lease=new)
    two.flush().result()
    stored = stored_trajectory(two, round_id).joint_actions.tolist()
    assert stored == [list(pair) for pair in [*joint_actions(1, 5), *one_soup()[5:]]]
    assert len(stored_trajectory(two, other).joint_actions) == 4
    with pytest.raises(LeaseLost, match="taken over"):
        one.finish_round(round_id, "finished", 0, 0, START_MS, b"", lease=old).result()
    with pytest.raises(LeaseLost):
        one.stand_in(round_id, 1, 5, "stay", "a" * 64, START_MS, lease=old).result()
    row = two.open_round(visit.id, "rounds-1").result()
    assert row is not None
    assert (row.status, row.stand_ins) == ("open", ())


def test_an_idle_owner_learns_that_it_lost_the_round(pair: tuple[Store, Store]) -> None:
    one, two = pair
    round_id = open_round(one, begin(one))
    lease = taken(one, round_id, "a", ttl_s=0.3)
    taken(two, round_id, "b", steal=True)
    wait_until(lambda: lease.lost)


def test_a_take_over_waits_for_a_write_that_is_under_way(pair: tuple[Store, Store]) -> None:
    """What the old owner commits after its check is seen by the new one, or is not written at all."""
    one, two = pair
    visit = begin(one)
    round_id = open_round(one, visit)
    actions = joint_actions(1, 3000)
    lease = taken(one, round_id, "a")
    for row in tick_rows(actions):
        one.journal(round_id, [row], lease=lease)
        if row.tick % 50 == 0:
            one.flush()
    new = two.lease_round(round_id, "b", LONG_S, steal=True).result()
    assert new is not None
    seen = two.open_round(visit.id, "rounds-1").result()
    assert seen is not None
    one.flush().result()
    assert len(stored_trajectory(two, round_id).joint_actions) == len(seen.joint_actions)


def test_keys_and_pings_are_signs_of_life_of_their_seat(store: Store) -> None:
    visit = begin(store)
    round_id = open_round(store, visit)
    for at in (1000, 4000, 30_000):
        store.journal(round_id, keys=[KeyRow(1, "up", True, 1.0, START_MS + at, 0, 1)])
        store.journal(round_id, clocks=[ClockRow(1.0, START_MS + at + 900, 20.0, 0)])
        store.flush().result()
    after = stored_visit(store, visit.token)
    assert after is not None
    assert after.last_seen_ms == START_MS + 30_000


def test_a15_two_servers_measure_one_clock_though_their_machines_differ(
    pair: tuple[Store, Store], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = pair
    one = first.read(wall_time).result()
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() - 3600)
    other = second.read(wall_time).result()
    assert other.wall_ms - one.wall_ms == pytest.approx((other.at_s - one.at_s) * 1000, abs=5000)
