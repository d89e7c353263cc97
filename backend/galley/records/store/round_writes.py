"""Writes about rounds: what each job does in its transaction. Each may be done twice and counts once."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from statistics import median
from typing import Any

from sqlalchemy import Connection, case, func, insert, select, update

from galley.errors import GalleyError
from galley.records.database import leases
from galley.records.database.engine import insert_into
from galley.records.database.leases import Lease, LeaseLost
from galley.records.database.tables import CLOCKS, ROUNDS, SEATS, STAND_INS, TICKS, VISITS
from galley.records.rows import NewRound, SeatRow
from galley.records.store.visit_writes import keep_questions, new_id


def set_up(connection: Connection, new: NewRound) -> int:
    """The id of the round that its people play at these steps, made now if there is none.

    Raises:
        GalleyError: a visit is unknown, or sits in another round at that step.
    """
    people = [seat for seat in new.seats if seat.visit_id is not None]
    there = {_round_at(connection, seat) for seat in people}
    if there != {None}:
        if len(there) > 1 or not people:
            raise GalleyError("a person of this round plays another one at that step")
        return int(there.pop() or 0)
    visits = [_visit(connection, int(seat.visit_id or 0)) for seat in people]
    if len({visit["study"] for visit in visits}) != 1:
        raise GalleyError("the people of a round must be in the same study")
    values = {name: getattr(new, name) for name in ("round_no", "layout", "layout_json", "horizon_ticks")}
    values |= {"tick_ms": new.tick_ms, "seed": str(new.seed), "episodes": new.episodes}
    values |= {"study": visits[0]["study"], "status": "open", "created_ms": round(new.at_ms)}
    round_id = new_id(connection, ROUNDS, values)
    connection.execute(insert(SEATS), [{**asdict(seat), "round_id": round_id} for seat in new.seats])
    for seat, visit in zip(people, visits, strict=True):
        keep_questions(connection, visit, str(seat.step_id), [("", 0)])
    return round_id


def _round_at(connection: Connection, seat: SeatRow) -> int | None:
    at_step = (SEATS.c.visit_id == seat.visit_id) & (SEATS.c.step_id == seat.step_id)
    return connection.execute(select(SEATS.c.round_id).where(at_step)).scalar_one_or_none()


def _visit(connection: Connection, visit_id: int) -> Mapping[str, Any]:
    query = select(VISITS.c.study, VISITS.c.step_index, VISITS.c.test).where(VISITS.c.id == visit_id)
    found = connection.execute(query).mappings().one_or_none()
    if found is None:
        raise GalleyError(f"there is no visit {visit_id}")
    return dict(found)


def stand_in(connection: Connection, round_id: int, values: Mapping[str, Any], lease: Lease | None) -> bool:
    """Note that an agent took a person's seat, unless one did before."""
    must_hold(connection, lease)
    new = insert_into(connection.engine, STAND_INS).values(round_id=round_id, **values)
    stored = new.on_conflict_do_nothing().returning(STAND_INS.c.seat)
    return connection.execute(stored).first() is not None


def must_hold(connection: Connection, lease: Lease | None) -> None:
    """Keep the lease from being taken until this transaction is over.

    Raises:
        LeaseLost: another process has taken the round over.
    """
    if lease is not None and leases.fence(connection, [lease]):
        lease.lose()
        raise LeaseLost(f"round {lease.round_id} was taken over by another server")


def finish(
    connection: Connection,
    round_id: int,
    status: str,
    score: int,
    deliveries: int,
    ended_ms: int,
    final_state: bytes,
    lease: Lease | None,
) -> bool:
    """Close the round and count its ticks, unless it was closed before.

    Raises:
        LeaseLost: another process has taken the round over.
    """
    must_hold(connection, lease)
    closing = {
        "status": status,
        "score": score,
        "deliveries": deliveries,
        "ended_ms": ended_ms,
        "final_sha256": hashlib.sha256(final_state).hexdigest(),
        **_counted(connection, round_id),
    }
    still_open = (ROUNDS.c.id == round_id) & (ROUNDS.c.status == "open")
    if connection.execute(update(ROUNDS).where(still_open).values(**closing)).rowcount == 0:
        return False
    pings = select(CLOCKS.c.seat, CLOCKS.c.rtt_ms).where(CLOCKS.c.round_id == round_id, CLOCKS.c.rtt_ms >= 0)
    trips: dict[int, list[float]] = {}
    for seat, rtt_ms in connection.execute(pings):
        trips.setdefault(seat, []).append(rtt_ms)
    for seat, times in trips.items():
        here = (SEATS.c.round_id == round_id) & (SEATS.c.seat == seat)
        connection.execute(update(SEATS).where(here).values(rtt_median_ms=median(times)))
    if lease is not None:
        leases.release(connection, lease)
    return True


def _counted(connection: Connection, round_id: int) -> dict[str, int]:
    late = func.coalesce(func.sum(case((TICKS.c.late, 1), else_=0)), 0)
    query = select(func.count(), late, func.count(TICKS.c.fault)).where(TICKS.c.round_id == round_id)
    counts = connection.execute(query).one()
    names = ("played_ticks", "late_ticks", "fault_ticks")
    return dict(zip(names, map(int, counts), strict=True))
