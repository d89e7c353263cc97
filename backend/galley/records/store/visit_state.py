"""Where a visit stands: everything that a page of it depends on, read at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, select

from galley.records.database.tables import ATTEMPTS, STAGES
from galley.records.rows import VisitRow
from galley.records.store import queries


@dataclass(frozen=True, slots=True)
class Attempt:
    """A failed attempt at a quiz: the step, which one it was (from 1), its answers by item."""

    step_id: str
    attempt: int
    answers: dict[str, Any]


@dataclass(frozen=True, slots=True)
class VisitState:
    """A visit with its answers by step and item, when each step was entered (ms), its last failed attempt."""

    visit: VisitRow
    answers: dict[str, dict[str, Any]]
    entered_ms: dict[str, int]
    attempt: Attempt | None


def visit_state(connection: Connection, token: str) -> VisitState | None:
    """Where the visit with this token stands; None if there is none."""
    visit = queries.visit(connection, token)
    if visit is None:
        return None
    stages = select(STAGES.c.step_id, STAGES.c.entered_ms).where(STAGES.c.visit_id == visit.id)
    entered = {step_id: int(at_ms) for step_id, at_ms in connection.execute(stages)}
    tries = select(ATTEMPTS.c.step_id, ATTEMPTS.c.attempt, ATTEMPTS.c.answers)
    last = (
        connection.execute(
            tries.where(ATTEMPTS.c.visit_id == visit.id)
            .order_by(ATTEMPTS.c.at_ms.desc(), ATTEMPTS.c.attempt.desc())
            .limit(1)
        )
        .mappings()
        .one_or_none()
    )
    attempt = None if last is None else Attempt(**last)
    return VisitState(visit, queries.answers(connection, visit.id), entered, attempt)
