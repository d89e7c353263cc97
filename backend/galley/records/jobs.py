"""Writes: what each job of the store does inside its transaction. Each may be done twice and counts once."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, Table, insert, select, update

from galley.errors import GalleyError
from galley.records.engine import insert_into
from galley.records.queries import visit_row
from galley.records.rows import VisitRow
from galley.records.tables import RESPONSES, ROUNDS, SEATS, STAGES, STUDIES, VISITS

NEW_VISIT: dict[str, Any] = {
    **dict.fromkeys(("completion_code", "ended_ms", "slot", "consent_sha256", "person")),
    "step_index": 0,
    "status": "active",
    "test": False,
    "language": "en",
    "tries": 0,
}


def next_visit_no(connection: Connection, study: str) -> int:
    """The next number of a study, given out for good."""
    _meet(connection, study)
    # The update locks the row, so that two servers cannot read the same count.
    here = STUDIES.c.name == study
    connection.execute(update(STUDIES).where(here).values(visits_begun=STUDIES.c.visits_begun + 1))
    return int(connection.execute(select(STUDIES.c.visits_begun).where(here)).scalar_one()) - 1


def create_visit(connection: Connection, values: Mapping[str, Any]) -> VisitRow:
    """The visit with these values, at its first step."""
    _meet(connection, values["study"])
    whole = {**NEW_VISIT, "last_seen_ms": values["created_ms"], **values}
    return visit_row({"id": _new_id(connection, VISITS, whole), **whole})


def _new_id(connection: Connection, table: Table, values: Mapping[str, Any]) -> int:
    return int(connection.execute(insert(table).values(**values).returning(table.c.id)).scalar_one())


def _meet(connection: Connection, study: str) -> None:
    row = {"name": study, "visits_begun": 0}
    connection.execute(insert_into(connection.engine, STUDIES).values(**row).on_conflict_do_nothing())


def enter_step(connection: Connection, visit_id: int, step_id: str, at_ms: int) -> None:
    """Count a view of a step; the first one says when it was entered."""
    new = insert_into(connection.engine, STAGES).values(
        visit_id=visit_id, step_id=step_id, entered_ms=at_ms, left_ms=None, views=1
    )
    connection.execute(
        new.on_conflict_do_update(
            index_elements=[STAGES.c.visit_id, STAGES.c.step_id], set_={"views": STAGES.c.views + 1}
        )
    )


def leave_step(
    connection: Connection,
    visit_id: int,
    step_id: str,
    answers: Sequence[Mapping[str, Any]],
    new_step_index: int,
    status: str,
    at_ms: int,
    completion_code: str | None,
) -> bool:
    """Store the answers and move on, unless the step was left before."""
    stage = insert_into(connection.engine, STAGES).values(
        visit_id=visit_id, step_id=step_id, entered_ms=at_ms, left_ms=None, views=0
    )
    connection.execute(stage.on_conflict_do_nothing())
    here = (STAGES.c.visit_id == visit_id) & (STAGES.c.step_id == step_id)
    left = connection.execute(update(STAGES).where(here, STAGES.c.left_ms.is_(None)).values(left_ms=at_ms))
    if left.rowcount == 0:
        return False
    if answers:
        here_and_now = {"visit_id": visit_id, "step_id": step_id, "at_ms": at_ms}
        connection.execute(insert(RESPONSES), [{**answer, **here_and_now} for answer in answers])
    changes: dict[str, Any] = {"step_index": new_step_index, "status": status}
    if status != "active":
        changes["ended_ms"] = at_ms
    if completion_code is not None:
        changes["completion_code"] = completion_code
    connection.execute(update(VISITS).where(VISITS.c.id == visit_id).values(**changes))
    return True


def create_round(
    connection: Connection, values: Mapping[str, Any], human: Mapping[str, Any], partner: Mapping[str, Any]
) -> int:
    """The id of the human's round at that step, made with these values if there is none.

    Raises: GalleyError if the visit is unknown.
    """
    at_step = (SEATS.c.visit_id == human["visit_id"]) & (SEATS.c.step_id == human["step_id"])
    there = connection.execute(select(SEATS.c.round_id).where(at_step)).scalar_one_or_none()
    if there is not None:
        return int(there)
    its_study = select(VISITS.c.study).where(VISITS.c.id == human["visit_id"])
    study = connection.execute(its_study).scalar_one_or_none()
    if study is None:
        raise GalleyError(f"there is no visit {human['visit_id']}")
    empty = dict.fromkeys(("visit_id", "step_id", "agent", "agent_sha256", "hat"))
    round_id = _new_id(connection, ROUNDS, {**values, "study": study, "status": "open"})
    connection.execute(insert(SEATS), [{**empty, "round_id": round_id, **seat} for seat in (human, partner)])
    return round_id


def finish_round(
    connection: Connection,
    round_id: int,
    status: str,
    score: int,
    deliveries: int,
    ended_ms: int,
    final_state: bytes,
) -> bool:
    """Close the round, unless it was closed before."""
    closing = {
        "status": status,
        "score": score,
        "deliveries": deliveries,
        "ended_ms": ended_ms,
        "final_sha256": hashlib.sha256(final_state).hexdigest(),
    }
    still_open = (ROUNDS.c.id == round_id) & (ROUNDS.c.status == "open")
    return connection.execute(update(ROUNDS).where(still_open).values(**closing)).rowcount == 1
