"""Visits under way: where they are in their plans, what time it is for them, and whose time has passed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import Connection, exists, func, or_, select

from galley.records.database import leases
from galley.records.database.tables import LEASES, ROUNDS, SEATS, VISITS

UnderWay = tuple[str, str, int]
"""The study of a visit under way, its plan as stored, the index of its step."""


def under_way(connection: Connection) -> list[UnderWay]:
    """Every active visit of every study."""
    query = select(VISITS.c.study, VISITS.c.plan_json, VISITS.c.step_index).where(VISITS.c.status == "active")
    return [(study, plan, int(index)) for study, plan, index in connection.execute(query)]


@dataclass(frozen=True, slots=True)
class WallTime:
    """The wall clock (ms) that all servers on a database share, at an instant of monotonic seconds."""

    wall_ms: float
    at_s: float


def wall_time(connection: Connection) -> WallTime:
    """What time it is."""
    connection.execute(select(1))  # opening the connection is not measured with
    before_s = time.monotonic()
    wall_ms = leases.now_ms(connection)
    return WallTime(wall_ms, (before_s + time.monotonic()) / 2)


def latest_ms(connection: Connection) -> float | None:
    """The latest time that a visit under way has; None while there is none."""
    query = select(func.max(VISITS.c.last_seen_ms)).where(VISITS.c.status == "active")
    latest = connection.execute(query).scalar()
    return None if latest is None else float(latest)


def overdue_tokens(connection: Connection, begun_before: Mapping[str, float], owner: str) -> list[str]:
    """The tokens of active visits that began before their study's time (ms), oldest first.

    Left out are those who play a round that another process than `owner` has.
    """
    late = [(VISITS.c.study == study) & (VISITS.c.created_ms <= ms) for study, ms in begun_before.items()]
    if not late:
        return []
    elsewhere = (
        exists()
        .where(SEATS.c.visit_id == VISITS.c.id)
        .where(ROUNDS.c.id == SEATS.c.round_id, ROUNDS.c.status == "open")
        .where(LEASES.c.round_id == ROUNDS.c.id, LEASES.c.owner.is_not(None), LEASES.c.owner != owner)
        .where(LEASES.c.expires_ms > leases.now_ms(connection))
    )
    query = select(VISITS.c.token).where(VISITS.c.status == "active", or_(*late), ~elsewhere)
    return list(connection.execute(query.order_by(VISITS.c.created_ms, VISITS.c.id)).scalars())
