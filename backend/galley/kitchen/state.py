"""Views of a kitchen's state: a row of int16 read as chefs, things and pots, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

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
    ONION,
    ORDERS_DELIVERED,
    POT,
    POT_COUNT,
    POT_TICKS,
    STAY,
    THINGS,
    TICK,
    TOMATO,
)
from galley.kitchen.layout import Layout, Place


@dataclass(frozen=True)
class ChefView:
    """One chef: cell, facing code, code of the held thing (0 for nothing)."""

    x: int
    y: int
    facing: int
    held: int = 0


@dataclass(frozen=True)
class PotView:
    """One pot: kind (0 none, 1 onion, 2 tomato), how many of them, cooking ticks so far, readiness."""

    kind: int = 0
    count: int = 0
    ticks: int = 0
    ready: bool = False


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


def pack_pot(kind: int, count: int, ticks: int) -> int:
    """One number for a pot's contents."""
    return kind + POT_COUNT * count + POT_TICKS * ticks


def unpack_pot(packed: int) -> tuple[int, int, int]:
    """(kind, count, cooking ticks) of a packed pot."""
    return packed % POT_COUNT, packed // POT_COUNT % POT_COUNT, packed // POT_TICKS


def view(layout: Layout, state: NDArray[np.int16]) -> KitchenView:
    """What a state int16[S] says, in words and places."""
    row = state.tolist()
    chefs = tuple(
        ChefView(*layout.place(row[at + CELL]), row[at + FACING], row[at + HELD]) for at in (0, CHEF)
    )
    pots = {}
    for place in layout.pots:
        kind, count, ticks = unpack_pot(row[CELLS + layout.cell(place)])
        ready = count == INGREDIENTS_PER_SOUP and ticks >= layout.rules.cook_time_ticks
        pots[place] = PotView(kind, count, ticks, ready)
    lying = {place: row[CELLS + layout.cell(place)] for place in layout.counters}
    return KitchenView(
        chefs=(chefs[0], chefs[1]),
        things={place: thing for place, thing in lying.items() if thing},
        pots=pots,
        tick=row[TICK],
        orders_delivered=row[ORDERS_DELIVERED],
        deliveries=row[DELIVERIES],
        score=row[DELIVERIES] * layout.rules.delivery_reward,
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
        state[CELLS + layout.cell(place)] = pack_pot(pot.kind, pot.count, pot.ticks)
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
        kind, count, ticks = unpack_pot(number)
        fits = number == 0
        if tile == COUNTER:
            fits = 0 <= number < len(THINGS)
        elif tile == POT and number > 0:
            full = count == INGREDIENTS_PER_SOUP
            fits = kind in (ONION, TOMATO) and count > 0 and 0 <= ticks <= full * layout.rules.cook_time_ticks
        if not fits:
            return f"cell {cell} holds {number}"
    return None
