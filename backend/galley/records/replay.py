"""Stored rounds played again: what happened in them, and whether that is what was stored."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import ACTIONS, Event, Kitchen, Layout
from galley.kitchen.codes import DELIVERIES
from galley.records.rows import RoundRow


@dataclass(frozen=True)
class Replay:
    """A round played again: states int16 [T+1, S], the reward of each tick, its events, what disagrees."""

    layout: Layout
    joint_actions: NDArray[np.uint8]
    states: NDArray[np.int16]
    rewards: tuple[int, ...]
    events: tuple[Event, ...]
    problems: tuple[str, ...]

    @property
    def score(self) -> int:
        """Reward summed over the round."""
        return sum(self.rewards)


def state_bytes(state: NDArray[np.int16]) -> bytes:
    """The bytes of a state that the records keep a hash of, the same on every machine."""
    return state.astype("<i2").tobytes()


def layout_of(row: RoundRow) -> Layout:
    """The layout that a round was played on. Raises GalleyError if what is stored is none."""
    try:
        return Layout.from_dict(json.loads(row.layout_json))
    except (ValueError, GalleyError) as error:
        raise GalleyError(f"round {row.id}: its stored layout cannot be read: {error}") from None


def replay_round(row: RoundRow, ticks_stored: tuple[int, ...] | None = None) -> Replay:
    """The round played again from its stored joint actions.

    `ticks_stored`: the numbers of the stored ticks; with them gaps are found.
    Raises: GalleyError if the layout cannot be read or an action is none.
    """
    layout = layout_of(row)
    wrong = np.argwhere(row.joint_actions >= len(ACTIONS))
    if len(wrong):
        tick, seat = map(int, wrong[0])
        action = int(row.joint_actions[tick, seat])
        raise GalleyError(f"round {row.id}: tick {tick}, seat {seat}: {action} is no action")
    kitchen = Kitchen(layout)
    states = [kitchen.state.copy()]
    rewards: list[int] = []
    events: list[Event] = []
    problems: list[str] = []
    for tick, (action_0, action_1) in enumerate(row.joint_actions.tolist()):
        if kitchen.done:
            problems.append(f"{len(row.joint_actions) - tick} ticks are stored after the end at tick {tick}")
            break
        rewards.append(kitchen.step(action_0, action_1))
        events += kitchen.events
        states.append(kitchen.state.copy())
    if ticks_stored is not None and ticks_stored != tuple(range(len(ticks_stored))):
        problems.append(_gap(ticks_stored))
    problems += _disagreements(row, kitchen)
    return Replay(layout, row.joint_actions, np.array(states), tuple(rewards), tuple(events), tuple(problems))


def _gap(ticks: tuple[int, ...]) -> str:
    missing = next(expected for expected, tick in enumerate(ticks) if expected != tick)
    return f"tick {missing} is missing: ticks {ticks[0]} to {ticks[-1]} are stored, {len(ticks)} in all"


def _disagreements(row: RoundRow, kitchen: Kitchen) -> list[str]:
    problems = []
    ticks = len(row.joint_actions)
    if row.status == "finished" and ticks != row.horizon_ticks and not kitchen.done:
        problems.append(f"it is finished with {ticks} of {row.horizon_ticks} ticks")
    if ticks > row.horizon_ticks:
        problems.append(f"{ticks} ticks are stored, its horizon is {row.horizon_ticks}")
    if row.status == "open":
        return problems
    if row.score != kitchen.score:
        problems.append(f"score: stored {row.score}, replayed {kitchen.score}")
    deliveries = int(kitchen.state[DELIVERIES])
    if row.deliveries != deliveries:
        problems.append(f"deliveries: stored {row.deliveries}, replayed {deliveries}")
    last = hashlib.sha256(state_bytes(kitchen.state)).hexdigest()
    if row.final_sha256 != last:
        problems.append(f"last state: stored hash {str(row.final_sha256)[:12]}, replayed {last[:12]}")
    return problems
