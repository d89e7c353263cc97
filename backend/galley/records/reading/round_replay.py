"""Stored rounds played again: what happened in them, and whether that is what was stored."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.kitchen.codes import DELIVERIES, ORDERS_DELIVERED, OUT_REWARD
from galley.kitchen.events import Event
from galley.kitchen.measures import Measures, measures_of
from galley.kitchen.trajectory import HUMAN, NOBODY, Replay, Seat, Trajectory, episodes_of, play
from galley.records.rows import RoundRow, SeatRow
from galley.study.stages.round_step import ALONE_AGENT


@dataclass(frozen=True, eq=False)
class Replayed:
    """A round played again from what is stored, episode by episode, and what disagrees with it."""

    trajectories: tuple[Trajectory, ...]
    episodes: tuple[Replay, ...]
    problems: tuple[str, ...]

    @property
    def measures(self) -> Measures:
        """The measures of the round: counts over all episodes, ticks counted on, performance on average."""
        found = [measures_of(*both) for both in zip(self.episodes, self.trajectories, strict=True)]
        return found[0] if len(found) == 1 else _together(found, self.starts)

    @property
    def starts(self) -> tuple[int, ...]:
        """The tick of the round that each episode begins with."""
        lengths = (len(trajectory.joint_actions) for trajectory in self.trajectories[:-1])
        return tuple(accumulate(lengths, initial=0))

    @property
    def rewards(self) -> list[int]:
        """The reward of every tick."""
        return [int(reward) for episode in self.episodes for reward in episode.out[:, OUT_REWARD]]

    def events(self) -> Iterator[Event]:
        """Everything that happened, with the ticks of the round."""
        for start, episode in zip(self.starts, self.episodes, strict=True):
            for event in episode.events():
                yield replace(event, tick=event.tick + start)


def _together(found: Sequence[Measures], starts: Sequence[int]) -> Measures:
    whole: dict[str, Any] = {}
    for field in fields(Measures):
        values = [getattr(one, field.name) for one in found]
        if field.name == "delivery_ticks":
            whole[field.name] = tuple(
                tick + start for ticks, start in zip(values, starts, strict=True) for tick in ticks
            )
        elif field.name == "concurrent_share":
            ticks = sum(one.ticks for one in found)
            whole[field.name] = sum(one.concurrent_ticks for one in found) / ticks if ticks else 0.0
        elif field.name == "performance":
            whole[field.name] = None if None in values else sum(values) / len(values)
        elif isinstance(values[0], tuple):
            whole[field.name] = tuple(map(sum, zip(*values, strict=True)))
        else:
            whole[field.name] = sum(values)
    return Measures(**whole)


def state_bytes(state: NDArray[np.int16]) -> bytes:
    """The bytes of a state that the records keep a hash of, the same on every machine."""
    return state.astype("<i2").tobytes()


def trajectories_of(row: RoundRow) -> tuple[Trajectory, ...]:
    """The trajectories of a stored round's episodes, as far as they were played; at least one.

    Raises:
        GalleyError: what is stored is no layout or no action.
    """
    try:
        layout = Layout.from_dict(json.loads(row.layout_json))
        first, second = map(_seat, row.seats)
        return episodes_of(Trajectory(layout, row.joint_actions, (first, second), row.seed), row.episodes)
    except (ValueError, GalleyError) as error:
        raise GalleyError(f"round {row.id}: {error}") from None


def nobody(seat: SeatRow) -> bool:
    """Whether the chef of a seat was not seen: the round was played alone."""
    return seat.agent == ALONE_AGENT and seat.hat is None


def _seat(seat: SeatRow) -> Seat:
    if nobody(seat):
        return NOBODY
    return HUMAN if seat.agent is None else Seat("agent", seat.agent, seat.agent_sha256 or "")


def replay_round(row: RoundRow, ticks_stored: Sequence[int]) -> Replayed:
    """The round played again from its stored joint actions; `ticks_stored` are the numbers of its ticks.

    Raises:
        GalleyError: what is stored is no layout or no action.
    """
    trajectories = trajectories_of(row)
    episodes = tuple(play(one.layout, one.joint_actions) for one in trajectories)
    problems = (*_misnumbered(ticks_stored), *_wrong_length(row, episodes), *_wrong_end(row, episodes))
    return Replayed(trajectories, episodes, problems)


def _misnumbered(ticks: Sequence[int]) -> list[str]:
    for expected, tick in enumerate(ticks):
        if tick != expected:
            return [
                f"tick {expected} is missing: {len(ticks)} ticks from {ticks[0]} to {ticks[-1]} are stored"
            ]
    return []


def _wrong_length(row: RoundRow, episodes: Sequence[Replay]) -> list[str]:
    last = episodes[-1]
    stored = len(last.out)
    played = last.ticks
    which = f" of episode {len(episodes)}" if row.episodes > 1 else ""
    if stored > played:
        return [f"{stored} ticks{which} are stored, yet the episode is over after {played}"]
    if stored > row.horizon_ticks:
        return [f"{stored} ticks{which} are stored, yet its horizon is {row.horizon_ticks}"]
    if row.status != "finished":
        return []
    if stored != row.horizon_ticks and not _all_served(last):
        return [f"it is finished after {stored} of {row.horizon_ticks} ticks{which}"]
    if len(episodes) != row.episodes:
        return [f"it is finished after {len(episodes)} of {row.episodes} episodes"]
    return []


def _all_served(episode: Replay) -> bool:
    orders = episode.layout.rules.orders
    return orders is not None and int(episode.states[-1, ORDERS_DELIVERED]) == len(orders)


def _wrong_end(row: RoundRow, episodes: Sequence[Replay]) -> list[str]:
    if row.status == "open":
        return []
    last = episodes[-1].states[-1]
    deliveries = sum(int(episode.states[-1, DELIVERIES]) for episode in episodes)
    found = (
        ("score", row.score, sum(one.score for one in episodes)),
        ("deliveries", row.deliveries, deliveries),
        ("hash of the last state", row.final_sha256, hashlib.sha256(state_bytes(last)).hexdigest()),
    )
    return [f"{what}: stored {was}, replayed {now}" for what, was, now in found if was != now]
