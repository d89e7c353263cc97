"""A played tick as a row of the field's public human data, so that existing behaviour cloning reads it.

Source: the rows that the `overcooked-demo` server of Carroll et al. writes and `human_aware_rl` reads (state
as `OvercookedState.to_dict` of the `overcooked-ai` 1.1.0 package, one row a tick).
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from galley.datasets.field_states import ACTIONS_THERE, state_there
from galley.kitchen.state import view
from galley.records.export.columns import Field, Sheet
from galley.records.reading.round_replay import Replayed
from galley.records.rows import RoundRow

HUMAN_DATA: Final = Sheet(
    "human-data",
    "One row per tick of every round that was played, in the schema of the field's public human data.",
    "visit_no, round, tick",
    (
        Field("state", "text", "kitchen before the joint action, as JSON: `OvercookedState.to_dict()`"),
        Field("joint_action", "text", 'both actions, as JSON: [x, y] directions or "interact"'),
        Field("reward", "whole number", "reward of the tick"),
        Field("time_left", "number", "seconds of the episode that are left after the tick"),
        Field("score", "whole number", "score of the episode after the tick"),
        Field("time_elapsed", "number", "seconds of the episode that were played before the tick"),
        Field("cur_gameloop", "whole number", "number of the tick within its episode, from 0"),
        Field("layout", "text", "tiles of the kitchen, as JSON: rows of characters"),
        Field("layout_name", "text", "name of the layout"),
        Field("trial_id", "text", "the episode: round and, from the second on, number of the episode"),
        Field("player_0_id", "text", "participant or agent in seat 0; empty if erased"),
        Field("player_1_id", "text", "participant or agent in seat 1; empty if erased"),
        Field("player_0_is_human", "true/false", "a person played seat 0 in this tick"),
        Field("player_1_is_human", "true/false", "a person played seat 1 in this tick"),
    ),
)


def rows_of(row: RoundRow, replay: Replayed, people: Mapping[int, str]) -> Iterator[dict[str, Any]]:
    """One row per tick of a round; `people` are the participants by seat."""
    for number, (episode, trajectory, start) in enumerate(
        zip(replay.episodes, replay.trajectories, replay.starts, strict=True)
    ):
        layout, score = trajectory.layout, 0
        trial = f"{row.id}" if number == 0 else f"{row.id}-{number + 1}"
        tiles = json.dumps([list(line.replace("1", " ").replace("2", " ")) for line in layout.grid])
        tick_s = row.tick_ms / 1000
        for tick, joint in enumerate(trajectory.joint_actions.tolist()):
            reward = int(episode.out[tick, 0])
            score += reward
            yield {
                "state": json.dumps(state_there(layout, view(layout, episode.states[tick]))),
                "joint_action": json.dumps([ACTIONS_THERE[action] for action in joint]),
                "reward": reward,
                "time_left": (row.horizon_ticks - tick - 1) * tick_s,
                "score": score,
                "time_elapsed": tick * tick_s,
                "cur_gameloop": tick,
                "layout": tiles,
                "layout_name": row.layout,
                "trial_id": trial,
                **_players(row, people, start + tick),
            }


def _players(row: RoundRow, people: Mapping[int, str], tick: int) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for seat in row.seats:
        agent = seat.agent
        for other in row.stand_ins:
            if other.seat == seat.seat and tick >= other.tick:
                agent = other.agent
        found[f"player_{seat.seat}_id"] = people.get(seat.seat) if agent is None else agent
        found[f"player_{seat.seat}_is_human"] = agent is None
    return found
