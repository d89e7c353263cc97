"""A layout: the static map of a kitchen together with its rules."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen.codes import (
    COUNTER,
    DISH_DISPENSER,
    FLOOR,
    ONION_DISPENSER,
    POT,
    POT_TICKS,
    RULE_SETS,
    SERVING,
    THINGS,
    TILE_LETTERS,
    TOMATO_DISPENSER,
)
from galley.kitchen.pots import whole_soup

Place = tuple[int, int]
"""A cell as (x, y): x grows east, y grows south, (0, 0) is the top left."""

_Scalar = TypeVar("_Scalar", bound=np.generic)

INGREDIENTS = ("onion", "tomato")
MAX_SIDE_TILES = 100
MAX_POTS = 31  # one bit each in a tick's outcome


@dataclass(frozen=True)
class GridProblem:
    """One thing wrong with a drawn grid; `row` counts from 0, None means the grid as a whole."""

    row: int | None
    message: str
    fix: str


@dataclass(frozen=True)
class Rules:
    """What a layout leaves open; without `orders` any soup pays, for ever."""

    rule_set: str = "classic"
    cook_time_ticks: int = 20
    delivery_reward: int = 20
    horizon_ticks: int = 400
    orders: tuple[str, ...] | None = None

    def problems(self) -> dict[str, str]:
        """What is wrong with each field, by the field's name; empty when all is well."""
        found = {}
        if self.rule_set not in RULE_SETS:
            found["rule_set"] = f"rule set {self.rule_set!r} is unknown; use {' or '.join(RULE_SETS)}"
        bounds = {"cook_time_ticks": (1, 2000), "delivery_reward": (0, 10_000), "horizon_ticks": (1, 32_000)}
        for name, (low, high) in bounds.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
                found[name] = f"{name} is {value!r}; use a whole number from {low} to {high}"
        if self.orders is not None:
            wrong = [order for order in self.orders if order not in INGREDIENTS]
            if not self.orders:
                found["orders"] = "the order list is empty; name onion or tomato, or leave orders out"
            elif wrong:
                found["orders"] = f"order {wrong[0]!r} is unknown; use onion or tomato"
            elif len(self.orders) > 1000:
                found["orders"] = f"{len(self.orders)} orders are too many; use at most 1000"
        return found


@dataclass(frozen=True)
class Layout:
    """A kitchen's map and rules; immutable, equal and hashed by content.

    `grid` holds one string per row, with `1` and `2` where seat 0 and seat 1 start.

    Raises:
        GalleyError: the grid or the rules cannot make a kitchen; the message names row, reason and fix.
    """

    name: str
    grid: tuple[str, ...]
    rules: Rules = Rules()
    title: str = ""
    aliases: tuple[str, ...] = ()
    source: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        for problem in grid_problems(self.grid):
            row = "" if problem.row is None else f", row {problem.row + 1}"
            raise GalleyError(f"layout {self.name!r}{row}: {problem.message}; {problem.fix}")
        for text in self.rules.problems().values():
            raise GalleyError(f"layout {self.name!r}: {text}")

    @classmethod
    def from_ascii(cls, name: str, text: str, **rules: Any) -> Layout:
        """The layout drawn in `text` (common indentation and blank lines around it are left out)."""
        rows = [row.rstrip() for row in text.splitlines() if row.strip()]
        indent = min((len(row) - len(row.lstrip()) for row in rows), default=0)
        return cls(name, tuple(row[indent:] for row in rows), Rules(**rules))

    def with_rules(self, **changes: Any) -> Layout:
        """The same map under other rules, e.g. `with_rules(horizon_ticks=100, orders=("onion", "onion"))`."""
        return replace(self, rules=replace(self.rules, **changes))

    def to_dict(self) -> dict[str, Any]:
        """The layout in full, as JSON can hold it."""
        rules = asdict(self.rules)
        rules["orders"] = None if self.rules.orders is None else list(self.rules.orders)
        return {
            "name": self.name,
            "title": self.title,
            "aliases": list(self.aliases),
            "source": self.source,
            "grid": list(self.grid),
            "rules": rules,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Layout:
        """The layout that `to_dict` wrote.

        Raises:
            GalleyError: a key is missing or holds something else than `to_dict` writes.
        """
        try:
            rules = dict(data["rules"])
            orders = rules.pop("orders", None)
            return cls(
                name=str(data["name"]),
                grid=tuple(str(row) for row in data["grid"]),
                rules=Rules(**rules, orders=None if orders is None else tuple(orders)),
                title=str(data.get("title", "")),
                aliases=tuple(data.get("aliases", ())),
                source=str(data.get("source", "")),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise GalleyError(f"not a layout: {error!r}; write it with Layout.to_dict") from error

    @property
    def width(self) -> int:
        """Tiles from west to east."""
        return len(self.grid[0])

    @property
    def height(self) -> int:
        """Tiles from north to south."""
        return len(self.grid)

    @cached_property
    def tiles(self) -> NDArray[np.uint8]:
        """uint8[H,W], read-only: the tile codes; chefs start on floor."""
        drawn = [[TILE_LETTERS.index(" " if tile in "12" else tile) for tile in row] for row in self.grid]
        return _frozen(np.array(drawn, dtype=np.uint8))

    @cached_property
    def starts(self) -> tuple[Place, Place]:
        """Where seat 0 and seat 1 start, as (x, y)."""
        text = "".join(self.grid)
        return self.place(text.index("1")), self.place(text.index("2"))

    def places(self, tile: int) -> tuple[Place, ...]:
        """All cells of one tile code as (x, y), in row-major order."""
        return tuple((int(x), int(y)) for y, x in np.argwhere(self.tiles == tile))

    @cached_property
    def pots(self) -> tuple[Place, ...]:
        """Pots as (x, y), in row-major order."""
        return self.places(POT)

    @cached_property
    def counters(self) -> tuple[Place, ...]:
        """Plain counters as (x, y), in row-major order."""
        return self.places(COUNTER)

    @cached_property
    def onions(self) -> tuple[Place, ...]:
        """Onion dispensers as (x, y), in row-major order."""
        return self.places(ONION_DISPENSER)

    @cached_property
    def tomatoes(self) -> tuple[Place, ...]:
        """Tomato dispensers as (x, y), in row-major order."""
        return self.places(TOMATO_DISPENSER)

    @cached_property
    def dishes(self) -> tuple[Place, ...]:
        """Dish dispensers as (x, y), in row-major order."""
        return self.places(DISH_DISPENSER)

    @cached_property
    def servings(self) -> tuple[Place, ...]:
        """Serving places as (x, y), in row-major order."""
        return self.places(SERVING)

    @cached_property
    def floor(self) -> tuple[Place, ...]:
        """Cells that chefs can stand on as (x, y), in row-major order."""
        return self.places(FLOOR)

    @cached_property
    def spec(self) -> NDArray[np.int16]:
        """int16[...], read-only: all that the kernels need, laid out as in `codes.py`."""
        orders = self.rules.orders or ()
        header = [
            self.width,
            self.height,
            RULE_SETS.index(self.rules.rule_set),
            self.rules.horizon_ticks,
            len(orders),
            len(self.pots),
            *(self.cell(place) for place in self.starts),
        ]
        recipes = [self.rules.cook_time_ticks] * POT_TICKS + [self.rules.delivery_reward] * POT_TICKS
        pots = [self.cell(place) for place in self.pots]
        ordered = [whole_soup(THINGS.index(order)) for order in orders]
        return _frozen(np.array([*header, *recipes, *self.tiles.ravel(), *pots, *ordered], dtype=np.int16))

    def cell(self, place: Place) -> int:
        """The cell index of (x, y): y * W + x."""
        return place[1] * self.width + place[0]

    def place(self, cell: int) -> Place:
        """The (x, y) of a cell index."""
        return cell % self.width, cell // self.width


def grid_problems(grid: tuple[str, ...]) -> list[GridProblem]:
    """Everything that keeps a drawn grid from being a kitchen; empty when all is well."""
    if not grid or not grid[0]:
        return [GridProblem(None, "the grid is empty", "draw at least 3 rows of tiles")]
    found: list[GridProblem] = []
    width = Counter(len(row) for row in grid).most_common(1)[0][0]
    if max(len(grid), width) > MAX_SIDE_TILES:
        fix = f"use at most {MAX_SIDE_TILES} by {MAX_SIDE_TILES} tiles"
        found.append(GridProblem(None, f"the grid is {width} by {len(grid)} tiles", fix))
    known = TILE_LETTERS + "12"
    letters = " ".join(known.strip())
    for number, row in enumerate(grid):
        if len(row) != width:
            told = f"the row has {len(row)} tiles, the others {width}"
            found.append(GridProblem(number, told, "make all rows equally long"))
        for tile in dict.fromkeys(row):
            if tile not in known:
                told = f"tile {tile!r} is unknown"
                found.append(GridProblem(number, told, f"use one of {letters} or a space"))
        edge = row if number in (0, len(grid) - 1) else row[:1] + row[-1:]
        if any(tile in " 12" for tile in edge):
            told = "the border is open, a chef could walk out"
            found.append(GridProblem(number, told, "close every edge, for instance with X"))
    for chef in "12":
        rows = [number for number, row in enumerate(grid) for tile in row if tile == chef]
        if not rows:
            found.append(GridProblem(None, f"chef {chef} is missing", f"put one {chef} on the floor"))
        found.extend(GridProblem(row, f"chef {chef} is there twice", f"keep one {chef}") for row in rows[1:])
    pots = sum(row.count("P") for row in grid)
    if pots > MAX_POTS:
        found.append(GridProblem(None, f"{pots} pots are too many", f"use at most {MAX_POTS}"))
    return found


def _frozen(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    array.flags.writeable = False
    return array
