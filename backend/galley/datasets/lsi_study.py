"""Games of the LSI user study, read from its CSV files, and whether the rules retell what was recorded.

One line a game: `lvl_type` (its kitchen's name), `workloads` (per chef: ingredients and dishes taken from
dispensers, soups served), `total_time_step`, `concurr_active`, `stuck_time`, `joint_actions`, `lvl_str` (the
grid). Seat 0 is the robot, seat 1 the human; two onion orders, soups cook 10 ticks, 150 ticks at most.

Source: Fontaine et al. 2021 (RSS), Sec. VII and App. F; its published logs.
"""

from __future__ import annotations

import ast
import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from galley.errors import GalleyError
from galley.kitchen.codes import INTERACT, STAY
from galley.kitchen.layout import Layout, Rules
from galley.kitchen.measures import Measures, measures
from galley.kitchen.reach import STEPS
from galley.kitchen.trajectory import HUMAN, Seat, Trajectory

COLUMNS: Final = (
    "lvl_type", "workloads", "total_time_step", "concurr_active", "stuck_time", "joint_actions", "lvl_str",
)  # fmt: skip
RULES: Final = Rules(cook_time_ticks=10, horizon_ticks=150, orders=("onion", "onion"))
_WORKLOADS: Final = ("num_ingre_held", "num_plate_held", "num_served")
_FIX: Final = "use the file as the study published it"
_LONGEST_FIELD: Final = 200_000


@dataclass(frozen=True)
class Figures:
    """What is compared of a game; pairs are seat 0, seat 1."""

    ticks: int
    orders: int
    ingredients: tuple[int, int]
    dishes: tuple[int, int]
    served: tuple[int, int]
    concurrent_ticks: int
    stuck_ticks: int


@dataclass(frozen=True, eq=False)
class StudyGame:
    """One game: where it stands (`file:line`), its trajectory, and the figures as recorded."""

    name: str
    place: str
    trajectory: Trajectory
    recorded: Figures

    def recomputed(self) -> Figures:
        """The figures of the game replayed under the rules."""
        found: Measures = measures(self.trajectory)
        return Figures(
            found.ticks, len(found.delivery_ticks), found.ingredients, found.dishes, found.served,
            found.concurrent_ticks, found.stuck_ticks,
        )  # fmt: skip

    def differences(self) -> tuple[str, ...]:
        """`figure: recorded a, recomputed b` for each figure that differs, and actions after the end."""
        found = self.recomputed()
        told = [
            f"{name}: recorded {wanted}, recomputed {getattr(found, name)}"
            for name, wanted in vars(self.recorded).items()
            if wanted != getattr(found, name)
        ]
        actions = len(self.trajectory.joint_actions)
        if actions != found.ticks:
            told.append(f"joint actions: recorded {actions}, played {found.ticks} before the episode ended")
        return tuple(told)


def read_games(path: Path) -> list[StudyGame]:
    """The games of one participant's file, in its order.

    Raises:
        GalleyError: `file:line: what is wrong; how to fix it` at the first line that is no game of the study.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise GalleyError(f"{path}: not a text file; {_FIX}") from None
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    games: list[StudyGame] = []
    line = 1
    try:
        header = next(reader, [])
        missing = [name for name in COLUMNS if name not in header]
        if missing:
            raise GalleyError(f"{path}:1: the column {missing[0]} is missing; {_FIX}")
        line = reader.line_num + 1
        for row in reader:
            if row:
                if len(row) != len(header):
                    raise GalleyError(f"{path}:{line}: {len(row)} fields, not {len(header)}; {_FIX}")
                games.append(_game(dict(zip(header, row, strict=True)), f"{path}:{line}"))
            line = reader.line_num + 1
    except csv.Error as error:
        raise GalleyError(f"{path}:{line}: not CSV ({error}); {_FIX}") from None
    if not games:
        raise GalleyError(f"{path}: the file holds no game; {_FIX}")
    return games


def _game(row: dict[str, str], place: str) -> StudyGame:
    name = row["lvl_type"]
    try:
        layout = Layout(name, tuple(row["lvl_str"].strip("\r\n").splitlines()), RULES)
    except GalleyError as error:
        raise GalleyError(f"{place}: {error}") from None
    pairs = _literal(row["joint_actions"], "joint_actions", place)
    if not isinstance(pairs, list) or any(not isinstance(pair, tuple) or len(pair) != 2 for pair in pairs):
        raise GalleyError(f"{place}: joint_actions is no list of pairs; {_FIX}")
    actions = np.array([[_action(one, place) for one in pair] for pair in pairs], dtype=np.uint8)
    trajectory = Trajectory(layout, actions.reshape(-1, 2), (Seat("agent", "lsi-qmdp"), HUMAN))
    return StudyGame(name, place, trajectory, _recorded(row, place))


def _recorded(row: dict[str, str], place: str) -> Figures:
    loads = _literal(row["workloads"], "workloads", place)
    if not isinstance(loads, list) or len(loads) != 2 or any(not isinstance(load, dict) for load in loads):
        raise GalleyError(f"{place}: workloads is no list of two chefs'; {_FIX}")
    pairs = []
    for key in _WORKLOADS:
        one, other = (load.get(key) for load in loads)
        if not isinstance(one, int) or not isinstance(other, int):
            raise GalleyError(f"{place}: workloads lack a whole number {key}; {_FIX}")
        pairs.append((one, other))
    counts = []
    for key in ("total_time_step", "concurr_active", "stuck_time"):
        if not row[key].strip().isascii() or not row[key].strip().isdigit():
            raise GalleyError(f"{place}: {key} is {row[key]!r}, not a whole number; {_FIX}")
        counts.append(int(row[key]))
    return Figures(counts[0], sum(pairs[2]), pairs[0], pairs[1], pairs[2], counts[1], counts[2])


def _action(told: Any, place: str) -> int:
    if told == "interact":
        return INTERACT
    if told == (0, 0):
        return STAY
    if told in STEPS:
        return STEPS.index(told)
    raise GalleyError(f"{place}: {told!r} is no action; {_FIX}")


def _literal(text: str, column: str, place: str) -> Any:
    if len(text) > _LONGEST_FIELD:
        raise GalleyError(f"{place}: {column} is too long; {_FIX}")
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError, TypeError):
        raise GalleyError(f"{place}: {column} cannot be read; {_FIX}") from None
