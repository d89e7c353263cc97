"""Games in the field's public schema: CSV files such as `galley export --human-data` writes, a row a tick.

A game begins where `trial_id` changes or `cur_gameloop` does not go on by one. The schema holds neither the
kitchen's rules nor the state after the last tick: cook time comes from the soups, the price from the rewards,
and the orders, where `all_orders` changes, from the soups that paid.
"""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from galley.datasets.field_states import action_here, state_here
from galley.datasets.overcooked_games import HumanGame
from galley.errors import GalleyError
from galley.kitchen.codes import ORDERS_DELIVERED, TICK
from galley.kitchen.layout import Layout, Rules
from galley.kitchen.state import from_view, state_problem

FIELD_COLUMNS: Final = (
    "state", "joint_action", "reward", "cur_gameloop", "layout", "layout_name", "trial_id",
)  # fmt: skip
"""The columns that are read; others of the schema may be there."""

_FIX: Final = "use the file as `galley export --human-data` or the field's own server wrote it"
_LONGEST_FIELD: Final = 1_000_000
_LONGEST_GAME: Final = 30_000
_TOLD_CHARACTERS: Final = 200

Row = Mapping[str, str]


def field_games(path: Path) -> list[HumanGame]:
    """All games in a CSV file, in its order.

    Raises:
        GalleyError: the file cannot be read, lacks a column, or holds a game that cannot be read; names the
            line.
    """
    return [_game(game, line, path) for line, game in _split(path)]


def _split(path: Path) -> Iterator[tuple[int, list[Row]]]:
    """(line of its first row, rows) of each game."""
    csv.field_size_limit(_LONGEST_FIELD)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            missing = [name for name in FIELD_COLUMNS if name not in (reader.fieldnames or ())]
            if missing:
                raise GalleyError(f"{path}:1: the column {missing[0]} is missing; {_FIX}")
            game: list[Row] = []
            begun = 2
            for row in reader:
                if game and not _goes_on(game[-1], row):
                    yield begun, game
                    game, begun = [], reader.line_num
                if len(game) >= _LONGEST_GAME:
                    raise GalleyError(f"{path}:{begun}: a game of more than {_LONGEST_GAME} ticks; {_FIX}")
                game.append(row)
            if not game:
                raise GalleyError(f"{path}: the file holds no game; {_FIX}")
            yield begun, game
    except OSError as error:
        raise GalleyError(f"{path}: cannot be read ({error.strerror or error}); check the path") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise GalleyError(f"{path}: is no CSV ({error}); {_FIX}") from None


def _goes_on(before: Row, row: Row) -> bool:
    try:
        following = int(row["cur_gameloop"]) == int(before["cur_gameloop"]) + 1
    except (TypeError, ValueError):
        return True  # the game itself tells it
    return following and row["trial_id"] == before["trial_id"]


def _game(rows: Sequence[Row], line: int, path: Path) -> HumanGame:
    try:
        return _read(rows, path.name)
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        told = str(error)[:_TOLD_CHARACTERS]
    except GalleyError as error:
        told = str(error)
    raise GalleyError(f"{path}:{line}: the game that begins here cannot be read ({told}); {_FIX}")


def _read(rows: Sequence[Row], file: str) -> HumanGame:
    states = [json.loads(row["state"]) for row in rows]
    if len(rows) < 2 or len({(row["layout"], row["layout_name"]) for row in rows}) != 1:
        raise ValueError("it has a single tick, or changes its layout")
    rewards = [round(float(row["reward"])) for row in rows]
    if int(rows[-1]["cur_gameloop"]) - int(rows[0]["cur_gameloop"]) != len(rows) - 1:
        raise ValueError("its ticks do not go on by one")
    paid = [reward for reward in rewards if reward > 0]
    cook_time = next((soup["cook_time"] for soup in _soups(states) if soup.get("cook_time", -1) > 0), 20)
    layout = Layout(
        rows[0]["layout_name"],
        _grid(json.loads(rows[0]["layout"]), states[0]["players"]),
        Rules(
            cook_time_ticks=cook_time,
            delivery_reward=min(paid, default=20),
            horizon_ticks=len(rows) + 1,
            orders=_orders(states, rewards),
        ),
    )
    made = np.stack([_state(layout, state) for state in states])
    made[:, TICK] = np.arange(len(rows))
    if layout.rules.orders is not None:
        made[1:, ORDERS_DELIVERED] = np.cumsum(np.array(rewards[:-1]) > 0)
    actions = [[action_here(one) for one in json.loads(row["joint_action"])] for row in rows]
    return HumanGame(
        layout=layout,
        states=made[:-1],
        joint_actions=np.array(actions[:-1], dtype=np.uint8).reshape(-1, 2),
        next_states=made[1:],
        rewards=np.array(rewards[:-1], dtype=np.int32),
        file=file,
    )


def _state(layout: Layout, told: Mapping[str, Any]) -> NDArray[np.int16]:
    state = from_view(layout, state_here(layout, told))
    state[TICK] = 0
    if problem := state_problem(layout, state):
        raise ValueError(problem)
    return state


def _grid(tiles: Any, players: Any) -> tuple[str, ...]:
    """The drawn grid: the recorded tiles with the chefs where they stood first."""
    drawn = [list(row) for row in tiles]
    for number, player in enumerate(players, 1):
        x, y = player["position"]
        drawn[y][x] = str(number)
    return tuple("".join(row) for row in drawn)


def _soups(states: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    for state in states:
        held = [player["held_object"] for player in state["players"] if player.get("held_object")]
        yield from (one for one in [*state["objects"], *held] if one["name"] == "soup")


def _orders(states: Sequence[Mapping[str, Any]], rewards: Sequence[int]) -> tuple[str, ...] | None:
    """The order list, as far as it was served and one further; None where orders never change."""
    open_ = [_kinds(state) for state in states]
    if len(set(open_)) == 1:
        return None
    served = [
        sorted((_carried(before) - _carried(after)).elements())[0]
        for before, after, reward in zip(states[:-1], states[1:], rewards[:-1], strict=True)
        if reward > 0
    ]
    return (*served, *(open_[-1][:1] or ("onion",)))


def _kinds(state: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(sorted({order["ingredients"][0] for order in state["all_orders"]}))


def _carried(state: Mapping[str, Any]) -> Counter[str]:
    """How many soups of each kind are in hands."""
    held = (player.get("held_object") for player in state["players"])
    return Counter(one["_ingredients"][0]["name"] for one in held if one and one["name"] == "soup")
