"""Arrivals: one slot each, lapsed ones given out again, on either kind of database and from two servers."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import pytest

from galley.records import Arrival, Begun, Planned, SlotRow, Store, VisitRow
from galley.records.store.arrivals import slots
from galley.study.visit.condition_slots import Full, Issue, allocate
from tests.postgres import Postgres
from tests.records import databases
from tests.records.helpers import START_MS, plan
from tests.records.stored import stored_visit

CELLS = ("a", "b", "c")
EXPIRES_MS = 60_000.0


def planned(visit_no: int, slot: int | None) -> Planned:
    """Slots go round the cells."""
    condition = {"arm": CELLS[(visit_no if slot is None else slot) % len(CELLS)]}
    return Planned(visit_no, plan(visit_no).to_json(), condition)


def taking(now_ms: float, capacity: int | None = None) -> Callable[[Sequence[SlotRow]], Issue | Full]:
    return lambda there: allocate(there, now_ms, EXPIRES_MS, capacity)


def arrive(
    store: Store,
    at_ms: float = START_MS,
    capacity: int | None = None,
    person: str | None = None,
    once: bool = False,
    test: bool = False,
) -> Begun:
    arrival = Arrival("demo", "d" * 64, at_ms, {"PID": person or ""}, "zh", person, once, test)
    return store.begin_visit(arrival, planned, taking(at_ms, capacity)).result()


def begun(came: Begun) -> VisitRow:
    assert came.visit is not None, came.why
    return came.visit


def leave(store: Store, visit: VisitRow, status: str, at_ms: float = START_MS + 1000) -> bool:
    return store.save_answers(visit.id, "consent", {}, 1, status, at_ms).result()


def test_each_arrival_has_the_next_slot(store: Store) -> None:
    visits = [begun(arrive(store)) for _ in range(4)]
    assert [visit.slot for visit in visits] == [0, 1, 2, 3]
    assert [visit.visit_no for visit in visits] == [0, 1, 2, 3]
    assert [visit.condition["arm"] for visit in visits] == ["a", "b", "c", "a"]
    assert visits[2] == stored_visit(store, visits[2].token)
    assert (visits[0].language, visits[0].last_seen_ms, visits[0].test) == ("zh", START_MS, False)


@pytest.mark.parametrize("status", ["declined", "screened_out", "failed_checks", "timed_out"])
def test_the_slot_of_somebody_who_left_is_given_out_again(store: Store, status: str) -> None:
    first, second = begun(arrive(store)), begun(arrive(store))
    assert leave(store, first, status)
    third = begun(arrive(store))
    assert (third.slot, third.condition, third.visit_no) == (0, first.condition, 2)
    assert begun(arrive(store)).slot == 2
    after = stored_visit(store, first.token)
    assert after is not None
    assert after.status == status
    assert leave(store, second, "completed")


def test_a_silent_visit_loses_its_slot_to_the_next_arrival_only(store: Store) -> None:
    first = begun(arrive(store))
    late = START_MS + EXPIRES_MS + 1
    still = stored_visit(store, first.token)
    assert still is not None
    assert still.status == "active"
    second = begun(arrive(store, late))
    assert second.slot == 0
    gone = stored_visit(store, first.token)
    assert gone is not None
    assert (gone.status, gone.ended_ms) == ("expired", late)
    assert leave(store, first, "completed", late) is False
    assert leave(store, second, "completed", late) is True
    with store.reading() as connection:
        (slot,) = slots(connection, "demo")
    assert (slot.completed, slot.visit_id) == (True, second.id)


def test_signs_of_life_keep_a_slot(store: Store) -> None:
    first, second = begun(arrive(store)), begun(arrive(store))
    store.save_answers(first.id, "consent", {}, 1, "active", START_MS + 50_000).result()
    store.enter_step(second.id, "consent", START_MS + 50_000).result()
    assert begun(arrive(store, START_MS + EXPIRES_MS + 1)).slot == 2


def test_a_full_study_says_whether_to_come_back(store: Store) -> None:
    visits = [begun(arrive(store, capacity=2)) for _ in range(2)]
    assert arrive(store, capacity=2) == Begun(None, "later")
    assert leave(store, visits[0], "completed")
    assert leave(store, visits[1], "completed")
    assert arrive(store, capacity=2) == Begun(None, "full")
    assert begun(arrive(store, capacity=3)).visit_no == 2, "a visit that was refused has no number"


def test_tests_take_no_slot_and_pass_a_closed_study(store: Store) -> None:
    assert begun(arrive(store, test=True)).slot is None
    store.set_study_state("demo", "paused", START_MS).result()
    assert arrive(store) == Begun(None, "paused")
    store.set_study_state("demo", "closed", START_MS).result()
    assert store.study_state("demo").result() == "closed"
    assert arrive(store) == Begun(None, "closed")
    assert begun(arrive(store, test=True)).test is True
    store.set_study_state("demo", "open", START_MS).result()
    assert begun(arrive(store)).slot == 0
    with pytest.raises(ValueError, match="'shut'"):
        store.set_study_state("demo", "shut", START_MS)


def test_a_person_comes_once_where_that_is_wanted(store: Store) -> None:
    first = arrive(store, person="ada", once=True)
    assert arrive(store, person="ada", once=True) == Begun(first.visit, "again")
    assert arrive(store, person="bob", once=True).why == "new"
    assert arrive(store, person="ada").why == "new"
    store.set_study_state("demo", "closed", START_MS).result()
    assert arrive(store, person="bob", once=True).why == "again", "who began may finish"


def test_an_arrival_whose_plan_fails_leaves_nothing(store: Store) -> None:
    def broken(visit_no: int, slot: int | None) -> Planned:
        raise ValueError("no such cell")

    arrival = Arrival("demo", "d" * 64, START_MS)
    with pytest.raises(ValueError, match="no such cell"):
        store.begin_visit(arrival, broken, taking(START_MS)).result()
    visit = begun(arrive(store))
    assert (visit.slot, visit.visit_no) == (0, 0)


def test_two_servers_never_give_out_the_same_slot(postgresql_server: Postgres) -> None:
    url = databases.postgresql(postgresql_server).url
    with Store.open(url, serving=True) as one, Store.open(url, serving=True) as two:
        draw = random.Random(3)

        def come(number: int) -> VisitRow:
            visit = begun(arrive((one, two)[number % 2], START_MS + number))
            if draw.random() < 0.3:
                leave((two, one)[number % 2], visit, "declined")
            return visit

        with ThreadPoolExecutor(8) as pool:
            visits = list(pool.map(come, range(60)))
        assert len({visit.visit_no for visit in visits}) == 60
        with one.reading() as connection:
            there = slots(connection, "demo")
        assert [slot.number for slot in there] == list(range(len(there)))
        holders = [slot.visit_id for slot in there]
        assert len(set(holders)) == len(holders)
        cells = Counter(json.dumps(slot.cell) for slot in there)
        assert max(cells.values()) - min(cells.values()) <= 1


def test_cells_stay_even_and_close_at_their_quota(store: Store) -> None:
    draw = random.Random(7)
    active: list[VisitRow] = []
    now = float(START_MS)
    came, quota = 0, 8
    while (begin := arrive(store, now, quota * len(CELLS))).why != "full":
        came += 1
        assert came < 400
        if begin.visit is not None:
            active.append(begin.visit)
        with store.reading() as connection:
            cells = Counter(slot.cell["arm"] for slot in slots(connection, "demo"))
        assert max(cells[cell] for cell in CELLS) - min(cells[cell] for cell in CELLS) <= 1
        now += 5000
        while len(active) > 6 or (active and begin.visit is None):
            visit = active.pop(draw.randrange(len(active)))
            fate = draw.random()
            if fate < 0.7:
                leave(store, visit, "completed", now)
            elif fate < 0.85:
                leave(store, visit, "screened_out", now)
    with store.reading() as connection:
        done = Counter(slot.cell["arm"] for slot in slots(connection, "demo") if slot.completed)
    assert done == dict.fromkeys(CELLS, quota)
