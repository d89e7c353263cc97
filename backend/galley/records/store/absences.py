"""When pages were hidden behind another tab or window, as the pages tell it."""

from __future__ import annotations

from typing import Final

from sqlalchemy import Connection, func, insert, select, update

from galley.records.database.tables import ABSENCES, VISITS

MOST_ABSENCES: Final = 500
"""So many a visit are kept: each is a write."""


def left_page(connection: Connection, visit_id: int, step_id: str, at_ms: int) -> None:
    """Note that a page was hidden, unless one is hidden already or there were too many."""
    mine = ABSENCES.c.visit_id == visit_id
    connection.execute(select(VISITS.c.id).where(VISITS.c.id == visit_id).with_for_update())
    count, ended = connection.execute(select(func.count(), func.count(ABSENCES.c.ended_ms)).where(mine)).one()
    latest = connection.execute(select(func.max(ABSENCES.c.started_ms)).where(mine)).scalar()
    if count == ended and count < MOST_ABSENCES and (latest is None or latest < at_ms):
        row = {"visit_id": visit_id, "step_id": step_id, "started_ms": at_ms, "ended_ms": None}
        connection.execute(insert(ABSENCES).values(**row))


def back_on_page(connection: Connection, visit_id: int, at_ms: int) -> None:
    """Note that a page is seen again, if one was hidden."""
    hidden = (ABSENCES.c.visit_id == visit_id) & ABSENCES.c.ended_ms.is_(None)
    connection.execute(update(ABSENCES).where(hidden).values(ended_ms=at_ms))
