"""What the records hold, read as pages, exports and replays read it."""

from __future__ import annotations

from typing import Any

from galley.kitchen.trajectory import Trajectory
from galley.records import Store, VisitRow
from galley.records.reading.round_replay import trajectories_of
from galley.records.store import queries


def stored_visit(store: Store, token: str) -> VisitRow | None:
    """The visit behind a link, None if there is none."""
    return store.read(lambda connection: queries.visit(connection, token)).result()


def stored_answers(store: Store, visit_id: int) -> dict[str, dict[str, Any]]:
    """For each step of a visit that was answered, its answers by item."""
    return store.read(lambda connection: queries.answers(connection, visit_id)).result()


def stored_episodes(store: Store, round_id: int) -> tuple[Trajectory, ...]:
    """All episodes of a round as far as they are committed."""
    with store.reading() as connection:
        return trajectories_of(queries.round_row(connection, round_id))


def stored_trajectory(store: Store, round_id: int) -> Trajectory:
    """The first episode of a round as far as it is committed."""
    return stored_episodes(store, round_id)[0]
