"""Stored rounds as footage for a film."""

from __future__ import annotations

from galley.film.footage import Footage, footage
from galley.records.reading.round_replay import trajectories_of
from galley.records.store import queries
from galley.records.store.store import Store


def footage_of_round(store: Store, round_id: int) -> Footage:
    """What there is to film of a round, as far as it was played: all its episodes, at its own pace and hats.

    Raises:
        GalleyError: there is no such round, or nothing of it can be drawn.
    """
    with store.reading() as connection:
        row = queries.round_row(connection, round_id)
    hats = [seat.hat for seat in row.seats]
    return footage(trajectories_of(row), f"round {round_id}", row.tick_ms, hats)
