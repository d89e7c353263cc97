"""The rows of those who wait for another person, and the one transaction that pairs two of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass

from sqlalchemy import Connection, delete, select

from galley.records.database import leases
from galley.records.database.engine import insert_into
from galley.records.database.tables import SEATS, STUDIES, VISITS, WAITING
from galley.records.rows import NewRound, VisitRow
from galley.records.store.queries import visit_row
from galley.records.store.round_writes import set_up

Together = Callable[[VisitRow, VisitRow], NewRound]
"""The round that two visits play; who waited longer comes first."""


@dataclass(frozen=True, slots=True)
class Waits:
    """A visit that waits at a step of its plan for one of the same `pairing`."""

    visit_id: int
    step_id: str
    step_index: int
    pairing: str


def wait(connection: Connection, waits: Waits, gone_s: float, together: Together) -> int | None:
    """The id of the visit's round, set up now if somebody waits who fits; None while it waits."""
    _take_turns(connection, waits.visit_id)
    there = _round_at(connection, waits.visit_id, waits.step_id)
    if there is not None:
        _forget(connection, waits.visit_id)
        return there
    now_ms = leases.now_ms(connection)
    since_ms = _ask(connection, waits, now_ms, now_ms - round(gone_s * 1000))
    mine = _visit(connection, waits.visit_id)
    if mine.status != "active" or mine.step_index != waits.step_index:
        _forget(connection, waits.visit_id)
        return None
    found = _longest(connection, waits, mine, now_ms - round(gone_s * 1000), now_ms)
    if found is None:
        return None
    other_since_ms, other = found
    first, second = (mine, other) if (since_ms, mine.id) < (other_since_ms, other.id) else (other, mine)
    round_id = set_up(connection, together(first, second))
    _forget(connection, mine.id, other.id)
    return round_id


def stop(connection: Connection, visit_id: int, step_id: str) -> int | None:
    """The id of the visit's round if it was paired; None once it does not wait any more."""
    _take_turns(connection, visit_id)
    _forget(connection, visit_id)
    return _round_at(connection, visit_id, step_id)


def _take_turns(connection: Connection, visit_id: int) -> None:
    """Keep all others off the lobby of the visit's study until this transaction is over."""
    study = select(VISITS.c.study).where(VISITS.c.id == visit_id).scalar_subquery()
    # Answers of visits refer to the study's row; with this lock they need not wait.
    connection.execute(select(STUDIES.c.name).where(STUDIES.c.name == study).with_for_update(key_share=True))


def _ask(connection: Connection, waits: Waits, now_ms: int, gone_ms: int) -> int:
    """Since when the visit waits; who comes back after long waits from now on."""
    here = WAITING.c.visit_id == waits.visit_id
    before = connection.execute(select(WAITING).where(here)).mappings().one_or_none()
    # Who asked later than now did so before the clock was set back.
    goes_on = (
        before is not None and before["step_id"] == waits.step_id and gone_ms < before["asked_ms"] <= now_ms
    )
    since_ms = int(before["since_ms"]) if before is not None and goes_on else now_ms
    row = {**asdict(waits), "since_ms": since_ms, "asked_ms": now_ms}
    new = insert_into(connection.engine, WAITING).values(**row)
    connection.execute(new.on_conflict_do_update(index_elements=[WAITING.c.visit_id], set_=row))
    return since_ms


def _longest(
    connection: Connection, waits: Waits, mine: VisitRow, gone_ms: int, now_ms: int
) -> tuple[int, VisitRow] | None:
    """Who waited longest of those that fit, and since when."""
    fits = (
        (VISITS.c.study == mine.study)
        & (VISITS.c.study_sha256 == mine.study_sha256)
        & (VISITS.c.test == mine.test)
        & (VISITS.c.status == "active")
        & (VISITS.c.step_index == WAITING.c.step_index)
        & (VISITS.c.id != mine.id)
    )
    query = (
        select(WAITING.c.since_ms, VISITS)
        .join(VISITS, VISITS.c.id == WAITING.c.visit_id)
        .where(fits, WAITING.c.pairing == waits.pairing)
        .where(WAITING.c.asked_ms > gone_ms, WAITING.c.asked_ms <= now_ms)
        .order_by(WAITING.c.since_ms, VISITS.c.id)
    )
    found = connection.execute(query.limit(1)).mappings().one_or_none()
    if found is None:
        return None
    values = dict(found)
    return int(values.pop("since_ms")), visit_row(values)


def _visit(connection: Connection, visit_id: int) -> VisitRow:
    return visit_row(dict(connection.execute(select(VISITS).where(VISITS.c.id == visit_id)).mappings().one()))


def _round_at(connection: Connection, visit_id: int, step_id: str) -> int | None:
    at_step = (SEATS.c.visit_id == visit_id) & (SEATS.c.step_id == step_id)
    return connection.execute(select(SEATS.c.round_id).where(at_step)).scalar_one_or_none()


def _forget(connection: Connection, *visits: int) -> None:
    connection.execute(delete(WAITING).where(WAITING.c.visit_id.in_(visits)))
