"""Games of pairs of people that the `overcooked-ai` 1.1.0 package ships, and how well the rules retell them.

Source: Carroll et al. 2019, human-human data; 76 games of about 1,200 ticks on the five layouts of the paper.
Three facts of the recording are normalised and nothing else: it pays 5 a soup where the rules pay 20, it lets
the timer of a pot run on past `cook_time`, and its order list is always `['onion']` and never used up.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from galley.datasets.pickled_frames import read_frame
from galley.errors import GalleyError
from galley.kitchen.codes import (
    CELLS,
    INGREDIENTS_PER_SOUP,
    INTERACT,
    OUT_REWARD,
    OUT_SIZE,
    POT,
    STAY,
    THINGS,
    TICK,
)
from galley.kitchen.layout import Layout, Rules
from galley.kitchen.reach import STEPS
from galley.kitchen.rules.tick import step_batch
from galley.kitchen.state import ChefView, KitchenView, PotView, from_view, state_problem
from galley.kitchen.trajectory import play

NAMES: Final = {"random0": "forced_coordination", "random3": "counter_circuit"}
"""Our names of the layouts that the recording calls otherwise."""

REWARD_FACTOR: Final = 4
_TEXTS: Final = ("layout_name", "layout", "state", "joint_action", "next_state")
_COLUMNS: Final = (*_TEXTS, "reward", "cur_gameloop")
_FIX: Final = "use the file as the overcooked-ai package ships it"
_LONGEST_GAME: Final = 30_000
_TOLD_CHARACTERS: Final = 200


@dataclass(frozen=True, eq=False)
class HumanGame:
    """One recorded game of T ticks.

    `layout` has our name, the recorded start places and a horizon of T. `states` int16[T,S] are the recorded
    states before each joint action (their tick counts up from 0), `joint_actions` uint8[T,2], `next_states`
    int16[T,S], `rewards` int32[T] in points of the rules. `file` is the name of the file it came from.
    """

    layout: Layout
    states: NDArray[np.int16]
    joint_actions: NDArray[np.uint8]
    next_states: NDArray[np.int16]
    rewards: NDArray[np.int32]
    file: str


@dataclass(frozen=True)
class ImportReport:
    """How the rules retell recorded games, transition by transition and each game from its first state on."""

    games: int
    transitions: int
    matched: int
    replayed: int
    """Games whose replay from the first state follows the record to its end."""
    first_mismatch: str = ""
    """Where the first transition that does not agree stands; empty if all agree."""

    def __add__(self, other: ImportReport) -> ImportReport:
        return ImportReport(
            self.games + other.games,
            self.transitions + other.transitions,
            self.matched + other.matched,
            self.replayed + other.replayed,
            self.first_mismatch or other.first_mismatch,
        )

    @property
    def mismatched(self) -> int:
        """Transitions that do not agree."""
        return self.transitions - self.matched


def import_files(
    paths: Iterable[Path], reader: Callable[[Path], list[HumanGame]] | None = None
) -> ImportReport:
    """The report on all games in files: pickled frames of human games, or what `reader` reads.

    Raises:
        GalleyError: a file cannot be read, is refused, or holds something else than such games.
    """
    report = ImportReport(0, 0, 0, 0)
    for path in paths:
        for number, game in enumerate((reader or human_games)(path)):
            agrees = matches(game)
            place = f"{path}: game {number}, {game.layout.name}, tick {int(agrees.argmin())}"
            report += ImportReport(
                1, len(agrees), int(agrees.sum()), int(follows(game)), "" if agrees.all() else place
            )
    return report


def matches(game: HumanGame) -> NDArray[np.bool_]:
    """bool[T]: for which ticks state and joint action lead to the recorded next state and reward."""
    states = game.states.copy()
    states[:, TICK] = 0
    out = np.zeros((len(states), OUT_SIZE), dtype=np.int32)
    step_batch(game.layout.spec, states, game.joint_actions, out)
    right = (_compared(states) == _compared(game.next_states)).all(axis=1)
    agrees: NDArray[np.bool_] = right & (out[:, OUT_REWARD] == game.rewards)
    return agrees


def follows(game: HumanGame) -> bool:
    """Whether the game replayed from its first state by its joint actions follows the record to its end."""
    episode = play(game.layout, game.joint_actions, game.states[0])
    recorded = np.concatenate([game.states, game.next_states[-1:]])
    same_states = np.array_equal(_compared(episode.states), _compared(recorded))
    return same_states and np.array_equal(episode.out[:, OUT_REWARD], game.rewards)


def _compared(states: NDArray[np.int16]) -> NDArray[np.int16]:
    """[..., S - 3]: what the recording knows of a state; tick and counts of deliveries are not in it."""
    return np.concatenate([states[..., :TICK], states[..., CELLS:]], axis=-1)


def human_games(path: Path) -> list[HumanGame]:
    """All games in a pickled frame of human games, in the order of the file.

    Raises:
        GalleyError: the file cannot be read, is refused, or holds something else than such games.
    """
    columns = read_frame(path)
    missing = [name for name in _COLUMNS if name not in columns]
    if missing:
        raise GalleyError(f"{path}: column {missing[0]} is missing; {_FIX}")
    for name in _COLUMNS:  # before anything is hashed, compared or shown: an object may be of any depth
        kinds = (str,) if name in _TEXTS else (int, float, np.number)
        odd = next((row for row, value in enumerate(columns[name]) if not isinstance(value, kinds)), None)
        if odd is not None:
            kind = type(columns[name][odd]).__name__
            raise GalleyError(f"{path}: row {odd} of column {name} holds a {kind}; {_FIX}")
    loop = columns["cur_gameloop"]
    starts = [row for row in range(len(loop)) if row == 0 or loop[row] != loop[row - 1] + 1]
    games = []
    for first, end in zip(starts, [*starts[1:], len(loop)], strict=True):
        game = {name: columns[name][first:end] for name in _COLUMNS}
        try:
            games.append(_game(game, path.name))
        except (
            KeyError,
            TypeError,
            ValueError,
            IndexError,
            AttributeError,
            OverflowError,
            RecursionError,
            GalleyError,
        ) as error:
            told = str(error)[:_TOLD_CHARACTERS]
            raise GalleyError(f"{path}: the game at row {first} cannot be read ({told}); {_FIX}") from None
    return games


def _game(columns: dict[str, NDArray[Any]], file: str) -> HumanGame:
    ticks = len(columns["state"])
    if ticks > _LONGEST_GAME or len(set(columns["layout"])) != 1 or len(set(columns["layout_name"])) != 1:
        raise ValueError("it is too long or changes its layout")
    name = columns["layout_name"][0]
    grid = tuple(_literal(columns["layout"][0]))
    layout = Layout(NAMES.get(name, name), grid, Rules(horizon_ticks=ticks))
    seen: dict[str, NDArray[np.int16]] = {}
    states = np.stack([_state(layout, text, seen) for text in columns["state"]])
    next_states = np.stack([_state(layout, text, seen) for text in columns["next_state"]])
    states[:, TICK] = np.arange(ticks)
    next_states[:, TICK] = np.arange(1, ticks + 1)
    actions = {text: _joint_action(text) for text in set(columns["joint_action"])}
    return HumanGame(
        layout=layout,
        states=states,
        joint_actions=np.array([actions[text] for text in columns["joint_action"]], dtype=np.uint8),
        next_states=next_states,
        rewards=(columns["reward"] * REWARD_FACTOR).astype(np.int32),
        file=file,
    )


def _state(layout: Layout, text: str, seen: dict[str, NDArray[np.int16]]) -> NDArray[np.int16]:
    """int16[S]: the state that the recording tells in `text`; each text is read once."""
    if text not in seen:
        data = _literal(text)
        if data["order_list"] != ["onion"]:
            raise ValueError(f"order list {data['order_list']}")
        first, second = (_chef(layout, player) for player in data["players"])
        things = {}
        pots = {}
        for record in data["objects"].values():
            x, y = record["position"]
            if layout.tiles[y, x] == POT:
                kind, count, ticks = record["state"]
                capped = min(ticks, layout.rules.cook_time_ticks)
                onions = count if kind == "onion" else 0
                pots[x, y] = PotView(onions, count - onions, capped)
            else:
                things[x, y] = _thing(layout, record)
        state = from_view(layout, KitchenView((first, second), things, pots))
        if problem := state_problem(layout, state):
            raise ValueError(problem)
        seen[text] = state
    return seen[text]


def _chef(layout: Layout, player: dict[str, Any]) -> ChefView:
    x, y = player["position"]
    held = player.get("held_object")
    facing = STEPS.index(tuple(player["orientation"]))
    return ChefView(x, y, facing, 0 if held is None else _thing(layout, held))


def _thing(layout: Layout, record: dict[str, Any]) -> int:
    if record["name"] != "soup":
        return THINGS.index(record["name"])
    kind, count, ticks = record["state"]
    if count != INGREDIENTS_PER_SOUP or ticks < layout.rules.cook_time_ticks:
        raise ValueError(f"an unfinished soup outside a pot: {record}")
    return THINGS.index(f"{kind}_soup")


def _joint_action(text: str) -> tuple[int, int]:
    first, second = (_action(action) for action in _literal(text))
    return first, second


def _action(action: Any) -> int:
    if action == "INTERACT":
        return INTERACT
    return STAY if action == [0, 0] else STEPS.index(tuple(action))


def _literal(text: str) -> Any:
    """What the recording wrote as Python's text of lists, dictionaries, words and numbers."""
    plain = text.replace("'", '"').replace("False", "false").replace("True", "true").replace("None", "null")
    return json.loads(plain)
