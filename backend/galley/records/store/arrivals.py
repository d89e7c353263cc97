"""An arrival in one transaction: who comes, which slot of the design is free, and the visit that begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, select, update

from galley.outcomes import NoRoom
from galley.records.database.engine import insert_into
from galley.records.database.tables import QUESTIONS, SLOTS, STUDIES, VISITS
from galley.records.rows import Arrival, Begun, Planned, SlotRow, VisitRow
from galley.records.store.queries import study_state, visit_row
from galley.records.store.visit_writes import NEW_VISIT, meet, new_id
from galley.study.visit.condition_slots import Full, Issue

Plan = Callable[[int, int | None], Planned]
Allocate = Callable[[Sequence[SlotRow]], Issue | Full]


def begin(
    connection: Connection,
    arrival: Arrival,
    names: Mapping[str, str],
    plan: Plan,
    allocate: Allocate | None,
) -> Begun:
    """What comes of an arrival; `names` are the new visit's token and participant.

    Arrivals at a study take turns, on all servers: each sees every slot as the one before left it.
    """
    meet(connection, arrival.study)
    study = (
        connection.execute(select(STUDIES).where(STUDIES.c.name == arrival.study).with_for_update())
        .mappings()
        .one()
    )
    there = _visit_with(connection, VISITS.c.token == names["token"])
    if there is not None:  # this job was done before, but the server never heard of it
        return Begun(there, "new")
    there = _visit_of(connection, arrival)
    if there is not None:
        return Begun(there, "again")
    if study["state"] != "open" and not arrival.test:
        return Begun(None, study["state"])
    slot = None
    if allocate is not None and not arrival.test:
        issue = _issue(connection, arrival, allocate)
        if isinstance(issue, Full):
            return Begun(None, "full" if issue.closed else "later")
        slot = issue.number
    visit_no = study["visits_begun"]
    connection.execute(
        update(STUDIES).where(STUDIES.c.name == arrival.study).values(visits_begun=visit_no + 1)
    )
    planned = plan(visit_no, slot)
    visit = _insert(connection, arrival, names, planned, visit_no, slot)
    if slot is not None:
        _hold(connection, visit, planned.condition if planned.cell is None else planned.cell)
    _keep_factors(connection, visit)
    return Begun(visit, "new")


def room_for(connection: Connection, arrival: Arrival, allocate: Allocate) -> NoRoom | None:
    """Why an arrival would find no room as things stand; None if it would, or comes back to its visit."""
    if _visit_of(connection, arrival) is not None:
        return None
    state = study_state(connection, arrival.study)
    if state != "open":
        return state
    issue = allocate(slots(connection, arrival.study))
    return ("full" if issue.closed else "later") if isinstance(issue, Full) else None


def slots(connection: Connection, study: str) -> list[SlotRow]:
    """Every slot of a study that was ever given out, in order of number."""
    query = (
        select(SLOTS, VISITS.c.status, VISITS.c.last_seen_ms, VISITS.c.step_index)
        .outerjoin(VISITS, VISITS.c.id == SLOTS.c.visit_id)
        .where(SLOTS.c.study == study)
        .order_by(SLOTS.c.number)
    )
    return [
        SlotRow(
            row["number"],
            completed=row["state"] == "completed",
            ended=row["state"] != "completed" and row["status"] != "active",
            last_seen_ms=row["held_at_ms"] if row["last_seen_ms"] is None else row["last_seen_ms"],
            cell=row["cell"],
            visit_id=row["visit_id"],
            answered=row["step_index"] != 0,
        )
        for row in connection.execute(query).mappings()
    ]


def _visit_of(connection: Connection, arrival: Arrival) -> VisitRow | None:
    """The visit that somebody had before who may have only one."""
    if arrival.person is None or not arrival.once or arrival.test:
        return None
    same = (VISITS.c.study == arrival.study) & (VISITS.c.person == arrival.person) & ~VISITS.c.test
    return _visit_with(connection, same)


def _visit_with(connection: Connection, condition: Any) -> VisitRow | None:
    found = connection.execute(
        select(VISITS).where(condition).order_by(VISITS.c.visit_no.desc()).limit(1)
    ).mappings()
    row = found.one_or_none()
    return None if row is None else visit_row(dict(row))


def _issue(connection: Connection, arrival: Arrival, allocate: Allocate) -> Issue | Full:
    """A slot to give out, taken from whoever left it."""
    while True:
        there = slots(connection, arrival.study)
        issue = allocate(there)
        if isinstance(issue, Full) or not issue.again:
            return issue
        old = next(slot for slot in there if slot.number == issue.number)
        if old.ended or _expire(connection, old, round(arrival.at_ms)):
            return issue


def _expire(connection: Connection, slot: SlotRow, at_ms: int) -> bool:
    """End the visit that has the slot, unless it gave a sign of life or ended just now."""
    as_seen = (VISITS.c.status == "active") & (VISITS.c.last_seen_ms == slot.last_seen_ms)
    over = (
        update(VISITS).where(VISITS.c.id == slot.visit_id, as_seen).values(status="expired", ended_ms=at_ms)
    )
    return connection.execute(over).rowcount == 1


def _insert(
    connection: Connection,
    arrival: Arrival,
    names: Mapping[str, str],
    planned: Planned,
    visit_no: int,
    slot: int | None,
) -> VisitRow:
    at_ms = round(arrival.at_ms)
    values = {
        **NEW_VISIT,
        **names,
        "study": arrival.study,
        "study_sha256": arrival.study_sha256,
        "visit_no": visit_no,
        "seed": str(planned.seed),
        "plan_json": planned.plan_json,
        "condition": dict(planned.condition),
        "link_params": dict(arrival.link_params),
        "created_ms": at_ms,
        "last_seen_ms": at_ms,
        "slot": slot,
        "test": arrival.test,
        "language": arrival.language,
        "person": arrival.person,
    }
    return visit_row({"id": new_id(connection, VISITS, values), **values})


def _hold(connection: Connection, visit: VisitRow, cell: Mapping[str, Any]) -> None:
    held = {"cell": dict(cell), "state": "held", "visit_id": visit.id, "held_at_ms": visit.created_ms}
    new = insert_into(connection.engine, SLOTS).values(study=visit.study, number=visit.slot, **held)
    same = [SLOTS.c.study, SLOTS.c.number]
    connection.execute(new.on_conflict_do_update(index_elements=same, set_=held))


def _keep_factors(connection: Connection, visit: VisitRow) -> None:
    rows = [
        {"study": visit.study, "step_id": "", "item": factor, "place": -1, "position": position}
        for position, factor in enumerate(visit.condition, 1)
    ]
    if rows and not visit.test:
        connection.execute(insert_into(connection.engine, QUESTIONS).on_conflict_do_nothing(), rows)
