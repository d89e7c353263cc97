"""Stored rounds played again: what happened in them, and whether that is what was stored."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.kitchen.codes import DELIVERIES, ORDERS_DELIVERED, TICK
from galley.kitchen.measures import Measures, measures_of
from galley.kitchen.trajectory import HUMAN, Replay, Seat, Trajectory, play
from galley.records.rows import RoundRow, SeatRow


@dataclass(frozen=True, eq=False)
class Replayed:
    """A round played again from what is stored, and what disagrees with it."""

    trajectory: Trajectory
    episode: Replay
    problems: tuple[str, ...]

    @property
    def measures(self) -> Measures:
        """The measures of the round."""
        return measures_of(self.episode, self.trajectory)


def state_bytes(state: NDArray[np.int16]) -> bytes:
    """The bytes of a state that the records keep a hash of, the same on every machine."""
    return state.astype("<i2").tobytes()


def trajectory_of(row: RoundRow) -> Trajectory:
    """The trajectory of a stored round, as far as it was played.

    Raises: GalleyError if what is stored is no layout or no action.
    """
    try:
        layout = Layout.from_dict(json.loads(row.layout_json))
        first, second = map(_seat, row.seats)
        return Trajectory(layout, row.joint_actions, (first, second), row.seed)
    except (ValueError, GalleyError) as error:
        raise GalleyError(f"round {row.id}: {error}") from None


def _seat(seat: SeatRow) -> Seat:
    return HUMAN if seat.agent is None else Seat("agent", seat.agent, seat.agent_sha256 or "")


def replay_round(row: RoundRow, ticks_stored: Sequence[int]) -> Replayed:
    """The round played again from its stored joint actions; `ticks_stored` are the numbers of its ticks.

    Raises: GalleyError if what is stored is no layout or no action.
    """
    trajectory = trajectory_of(row)
    episode = play(trajectory.layout, trajectory.joint_actions)
    problems = (*_misnumbered(ticks_stored), *_wrong_length(row, episode), *_wrong_end(row, episode))
    return Replayed(trajectory, episode, problems)


def _misnumbered(ticks: Sequence[int]) -> list[str]:
    for expected, tick in enumerate(ticks):
        if tick != expected:
            return [
                f"tick {expected} is missing: {len(ticks)} ticks from {ticks[0]} to {ticks[-1]} are stored"
            ]
    return []


def _wrong_length(row: RoundRow, episode: Replay) -> list[str]:
    stored = len(row.joint_actions)
    played = int(episode.states[-1, TICK])  # the clock stands still once the episode is over
    if stored > played:
        return [f"{stored} ticks are stored, yet the episode is over after {played}"]
    if stored > row.horizon_ticks:
        return [f"{stored} ticks are stored, yet its horizon is {row.horizon_ticks}"]
    if row.status == "finished" and stored != row.horizon_ticks and not _all_served(episode):
        return [f"it is finished after {stored} of {row.horizon_ticks} ticks"]
    return []


def _all_served(episode: Replay) -> bool:
    orders = episode.layout.rules.orders
    return orders is not None and int(episode.states[-1, ORDERS_DELIVERED]) == len(orders)


def _wrong_end(row: RoundRow, episode: Replay) -> list[str]:
    if row.status == "open":
        return []
    last = episode.states[-1]
    deliveries = int(last[DELIVERIES])
    found = (
        ("score", row.score, deliveries * episode.layout.rules.delivery_reward),
        ("deliveries", row.deliveries, deliveries),
        ("hash of the last state", row.final_sha256, hashlib.sha256(state_bytes(last)).hexdigest()),
    )
    return [f"{what}: stored {was}, replayed {now}" for what, was, now in found if was != now]
