"""Who waits is paired once, with who fits and waited longest, whichever server hears of it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

from sqlalchemy import select, update

from galley.records import NewRound, SeatRow, Store, VisitRow
from galley.records.database.tables import VISITS, WAITING
from galley.records.store.pairing import Waits
from tests.records.helpers import START_MS, begin

GONE_S = 60.0


def together(first: VisitRow, second: VisitRow) -> NewRound:
    seats = (SeatRow(0, first.id, "rounds-1"), SeatRow(1, second.id, "rounds-1"))
    return NewRound(1, "ring", "{}", 10, 150, 7, START_MS, seats)


def wait(store: Store, visit: VisitRow, pairing: str = "same", gone_s: float = GONE_S) -> int | None:
    waits = Waits(visit.id, "rounds-1", visit.step_index, pairing)
    return store.wait_for_partner(waits, gone_s, together).result()


def change(store: Store, visit: VisitRow, **values: Any) -> None:
    store.write(
        lambda connection: connection.execute(update(VISITS).where(VISITS.c.id == visit.id).values(**values))
    ).result()


def waiting(store: Store) -> list[int]:
    with store.reading() as connection:
        return list(connection.execute(select(WAITING.c.visit_id).order_by(WAITING.c.visit_id)).scalars())


def seats(store: Store, visit: VisitRow) -> list[int | None]:
    row = store.open_round(visit.id, "rounds-1").result()
    return [] if row is None else [seat.visit_id for seat in row.seats]


def test_the_one_who_waited_longest_comes_first(store: Store) -> None:
    one, two, three = (begin(store) for _ in range(3))
    assert wait(store, one) is None
    assert wait(store, one) is None, "nobody is paired with themselves"
    round_id = wait(store, two)
    assert round_id is not None
    assert wait(store, one) == wait(store, two) == round_id
    assert seats(store, one) == [one.id, two.id]
    assert wait(store, three) is None
    assert waiting(store) == [three.id]


def test_only_those_who_fit_are_paired(store: Store) -> None:
    one, other, gone, moved, ended, test = (begin(store) for _ in range(6))
    for visit in (gone, moved, ended, test):
        assert wait(store, visit, pairing=f"of {visit.id}") is None
    change(store, moved, step_index=5)
    change(store, ended, status="expired")
    change(store, test, test=True)
    assert wait(store, one) is None
    assert wait(store, other, pairing="another round") is None
    for visit in (moved, ended, test):
        assert wait(store, one, pairing=f"of {visit.id}") is None
    assert wait(store, one, pairing=f"of {gone.id}", gone_s=0.0) is None, "asked too long ago"
    assert wait(store, one, pairing=f"of {gone.id}") is not None


def test_who_stopped_waiting_is_not_paired_and_who_was_paired_hears_of_it(store: Store) -> None:
    one, two, three = (begin(store) for _ in range(3))
    assert wait(store, one) is None
    assert store.stop_waiting(one.id, "rounds-1").result() is None
    assert wait(store, two) is None
    round_id = wait(store, three)
    assert store.stop_waiting(two.id, "rounds-1").result() == round_id is not None
    assert waiting(store) == []


def test_many_who_ask_again_and_again_are_each_paired_once(store: Store) -> None:
    people = [begin(store) for _ in range(12)]
    with ThreadPoolExecutor(6) as pool:
        list(pool.map(lambda visit: wait(store, visit), [*people, *people]))
    pairs = [seats(store, visit) for visit in people]
    assert all(len(pair) == 2 for pair in pairs)
    assert sorted(one for pair in pairs for one in pair if one is not None) == sorted(
        [visit.id for visit in people] * 2
    )


def test_an_erased_visit_waits_no_more(store: Store) -> None:
    visit = begin(store)
    assert wait(store, visit) is None
    store.write(
        lambda connection: connection.execute(VISITS.delete().where(VISITS.c.id == visit.id))
    ).result()
    assert waiting(store) == []


def test_a15_who_asked_before_the_clock_was_set_back_is_not_taken_for_somebody_who_waits(
    store: Store,
) -> None:
    gone, one, two = (begin(store) for _ in range(3))
    assert wait(store, gone) is None
    hour_ms = 3_600_000
    later = update(WAITING).values(
        since_ms=WAITING.c.since_ms + hour_ms, asked_ms=WAITING.c.asked_ms + hour_ms
    )
    store.write(lambda connection: connection.execute(later)).result()
    assert wait(store, one) is None, "nobody asked within the last minute"
    assert wait(store, two) is not None
    assert seats(store, one) == [one.id, two.id]
