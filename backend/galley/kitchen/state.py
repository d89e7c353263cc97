"""Views of a kitchen's state: a row of int16 read as chefs, things and pots, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from galley.kitchen.codes import (
    CELL,
    CELLS,
    CHEF,
    COUNTER,
    DELIVERIES,
    FACING,
    FLOOR,
    HELD,
    INGREDIENTS_PER_SOUP,
    ORDERS_DELIVERED,
    POT,
    POT_TICKS,
    STAY,
    THINGS,
    TICK,
)
from galley.kitchen.layout import Layout, Place
from galley.kitchen.pots import amount_in, is_soup, onions_in, recipe_of, ticks_in, ticks_left

_Count = TypeVar("_Count", int, NDArray[np.int32])


@dataclass(frozen=True)
class ChefView:
    """One chef: cell, facing code, code of the held thing (0 for nothing)."""

    x: int
    y: int
    facing: int
    held: int = 0


@dataclass(frozen=True)
class PotView:
    """One pot: onions and tomatoes in it, cooking ticks so far, readiness."""

    onions: int = 0
    tomatoes: int = 0
    ticks: int = 0
    ready: bool = False

    @property
    def count(self) -> int:
        """How many ingredients are in it."""
        return self.onions + self.tomatoes


@dataclass(frozen=True)
class KitchenView:
    """A kitchen for reading: `things` by the (x, y) of their counter, all `pots` by (x, y), empty or not."""

    chefs: tuple[ChefView, ChefView]
    things: Mapping[Place, int] = field(default_factory=dict)
    pots: Mapping[Place, PotView] = field(default_factory=dict)
    tick: int = 0
    orders_delivered: int = 0
    deliveries: int = 0
    score: int = 0


def state_size(layout: Layout) -> int:
    """How many int16 one kitchen takes."""
    return CELLS + layout.width * layout.height


def pot_view(layout: Layout, pot: int) -> PotView:
    """What a packed pot holds."""
    onions = onions_in(pot)
    ready = is_soup(pot) and ticks_left(layout.spec, pot) <= 0
    return PotView(onions, amount_in(pot) - onions, ticks_in(pot), ready)


def points(layout: Layout, deliveries: _Count) -> _Count:
    """What so many paid deliveries (a whole number, or an array of them) amount to."""
    return deliveries * layout.rules.delivery_reward


def score_of(layout: Layout, states: NDArray[np.int16]) -> NDArray[np.int32]:
    """int32[...]: the points made since the start in each state of int16[..., S]."""
    return points(layout, states[..., DELIVERIES].astype(np.int32))


def view(layout: Layout, state: NDArray[np.int16]) -> KitchenView:
    """What a state int16[S] says, in words and places."""
    row = state.tolist()
    chefs = tuple(
        ChefView(*layout.place(row[at + CELL]), row[at + FACING], row[at + HELD]) for at in (0, CHEF)
    )
    pots = {place: pot_view(layout, row[CELLS + layout.cell(place)]) for place in layout.pots}
    lying = {place: row[CELLS + layout.cell(place)] for place in layout.counters}
    return KitchenView(
        chefs=(chefs[0], chefs[1]),
        things={place: thing for place, thing in lying.items() if thing},
        pots=pots,
        tick=row[TICK],
        orders_delivered=row[ORDERS_DELIVERED],
        deliveries=row[DELIVERIES],
        score=points(layout, row[DELIVERIES]),
    )


def from_view(layout: Layout, seen: KitchenView) -> NDArray[np.int16]:
    """int16[S]: the state that `view` shows as `seen`; `ready` and `score` follow from the rest."""
    state = np.zeros(state_size(layout), dtype=np.int16)
    for at, chef in zip((0, CHEF), seen.chefs, strict=True):
        state[at + CELL] = layout.cell((chef.x, chef.y))
        state[at + FACING] = chef.facing
        state[at + HELD] = chef.held
    state[TICK] = seen.tick
    state[ORDERS_DELIVERED] = seen.orders_delivered
    state[DELIVERIES] = seen.deliveries
    for place, thing in seen.things.items():
        state[CELLS + layout.cell(place)] = thing
    for place, pot in seen.pots.items():
        state[CELLS + layout.cell(place)] = recipe_of(pot.onions, pot.tomatoes) + POT_TICKS * pot.ticks
    return state


def state_problem(layout: Layout, state: NDArray[np.int16]) -> str | None:
    """Why `state` cannot be a state of this layout, or None; for states that come from outside."""
    if state.shape != (state_size(layout),) or state.dtype != np.int16:
        return f"it must be int16 [{state_size(layout)}], not {state.dtype} {list(state.shape)}"
    row = state.tolist()
    tiles = layout.tiles.ravel().tolist()
    for seat, at in enumerate((0, CHEF)):
        cell, facing, held = row[at : at + CHEF]
        on_floor = 0 <= cell < len(tiles) and tiles[cell] == FLOOR
        if not (on_floor and 0 <= facing < STAY and 0 <= held < len(THINGS)):
            return f"chef {seat} has cell, facing, held thing {cell}, {facing}, {held}"
    if row[CELL] == row[CHEF + CELL]:
        return "both chefs are in one cell"
    orders = len(layout.rules.orders or ())
    if row[TICK] < 0 or row[DELIVERIES] < 0 or not 0 <= row[ORDERS_DELIVERED] <= orders:
        return f"tick, orders delivered, deliveries are {row[TICK:CELLS]}"
    for cell, (tile, number) in enumerate(zip(tiles, row[CELLS:], strict=True)):
        fits = number == 0
        if tile == COUNTER:
            fits = 0 <= number < len(THINGS)
        elif tile == POT and number > 0:
            amount = amount_in(number)
            most = layout.rules.cook_time_ticks if amount == INGREDIENTS_PER_SOUP else 0
            fits = amount > 0 and onions_in(number) in (0, amount) and ticks_in(number) <= most
        if not fits:
            return f"cell {cell} holds {number}"
    return None
