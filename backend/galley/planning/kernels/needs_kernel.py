"""What a kitchen needs next and where it is had: orders, room in pots, things on counters; compiled."""

from __future__ import annotations

from numpy import bool_, int16
from numpy.typing import NDArray

from galley.compiled.kernels import lean_kernel
from galley.kitchen.codes import (
    CELLS,
    CHEF,
    COUNTER,
    DISH,
    DISH_DISPENSER,
    HELD,
    INGREDIENTS_PER_SOUP,
    NOTHING,
    ONION,
    ONION_DISPENSER,
    ONION_SOUP,
    ORDERS_DELIVERED,
    POT,
    SPEC_HEIGHT,
    SPEC_ORDERS,
    SPEC_POTS,
    SPEC_TILES,
    SPEC_WIDTH,
    TOMATO,
    TOMATO_DISPENSER,
)
from galley.kitchen.pots import amount_in, is_all, is_soup, recipe_in, recipe_of_thing, soup_of

NOWHERE = -1


@lean_kernel
def tile_at(spec: NDArray[int16], cell: int) -> int:
    """The code of the tile of a cell."""
    return int(spec[SPEC_TILES + cell])


@lean_kernel
def dispenser_of(thing: int) -> int:
    """The tile that gives an ingredient or a dish."""
    if thing == DISH:
        return DISH_DISPENSER
    return ONION_DISPENSER if thing == ONION else TOMATO_DISPENSER


@lean_kernel
def reaches_tile(spec: NDArray[int16], reach: NDArray[bool_], seat: int, tile: int) -> bool:
    """Whether a seat can face some tile of this code."""
    found = False
    for cell in range(reach.shape[1]):
        found = found or (reach[seat, cell] and spec[SPEC_TILES + cell] == tile)
    return found


@lean_kernel
def lying(state: NDArray[int16], spec: NDArray[int16], reach: NDArray[bool_], seat: int, thing: int) -> int:
    """How many of a thing lie on counters that a seat can reach."""
    count = 0
    for cell in range(reach.shape[1]):
        if reach[seat, cell] and tile_at(spec, cell) == COUNTER and state[CELLS + cell] == thing:
            count += 1
    return count


@lean_kernel
def open_order(spec: NDArray[int16], state: NDArray[int16], later: int) -> int:
    """The ingredient of the order `later` places behind the first open one; NOTHING beyond the list's end."""
    place = state[ORDERS_DELIVERED] + later
    if place >= spec[SPEC_ORDERS]:
        return NOTHING
    recipe = int(spec[SPEC_TILES + spec[SPEC_WIDTH] * spec[SPEC_HEIGHT] + spec[SPEC_POTS] + place])
    return ONION if is_all(recipe, ONION) else TOMATO


@lean_kernel
def wanted_kind(spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_]) -> int:
    """The ingredient of the next soup to begin: that of the first open order that no soup answers yet."""
    if spec[SPEC_ORDERS] == 0:
        onions = reaches_tile(spec, reach, 0, ONION_DISPENSER) or reaches_tile(
            spec, reach, 1, ONION_DISPENSER
        )
        return ONION if onions else TOMATO
    onion_soups = 0
    tomato_soups = 0
    for cell in range(reach.shape[1]):
        recipe = 0
        if tile_at(spec, cell) == POT:
            recipe = recipe_in(int(state[CELLS + cell]))
        elif tile_at(spec, cell) == COUNTER and state[CELLS + cell] >= ONION_SOUP:
            recipe = recipe_of_thing(int(state[CELLS + cell]))
        onion_soups += is_all(recipe, ONION)
        tomato_soups += is_all(recipe, TOMATO)
    for seat in range(2):
        onion_soups += state[CHEF * seat + HELD] == soup_of(ONION)
        tomato_soups += state[CHEF * seat + HELD] == soup_of(TOMATO)
    for later in range(spec[SPEC_ORDERS]):
        kind = open_order(spec, state, later)
        if kind == ONION and onion_soups > 0:
            onion_soups -= 1
        elif kind == TOMATO and tomato_soups > 0:
            tomato_soups -= 1
        else:
            return kind
    return NOTHING


@lean_kernel
def pot_room(packed: int, wanted: int, ingredient: int, any_order: bool) -> int:
    """How many of an ingredient a pot can take, 0 if it should get none."""
    if packed == 0:
        return INGREDIENTS_PER_SOUP if any_order or ingredient == wanted else 0
    return INGREDIENTS_PER_SOUP - amount_in(packed) if is_all(packed, ingredient) else 0


@lean_kernel
def need_of(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], seat: int, thing: int, wanted: int,
    not_for: int,
) -> int:  # fmt: skip
    """How many of a thing the pots call for that `seat` reaches and seat `not_for` (-1: none) does not."""
    need = 0
    for cell in range(reach.shape[1]):
        if tile_at(spec, cell) != POT or not reach[seat, cell] or (not_for >= 0 and reach[not_for, cell]):
            continue
        packed = int(state[CELLS + cell])
        if thing == DISH:
            need += is_soup(packed)
        else:
            need += pot_room(packed, wanted, thing, False)
    return need


@lean_kernel
def must_pass(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], seat: int, thing: int, wanted: int
) -> bool:
    """Whether the other chef needs a thing that only this one can get, beyond what it holds or finds."""
    other = 1 - seat
    need = need_of(spec, state, reach, other, thing, wanted, seat)
    if need == 0 or reaches_tile(spec, reach, other, dispenser_of(thing)):
        return False
    return bool(need > lying(state, spec, reach, other, thing) + (state[CHEF * other + HELD] == thing))


@lean_kernel
def free_counter(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    shared: bool,
) -> int:  # fmt: skip
    """The nearest empty counter, one that the other chef reaches too or one that it does not."""
    best = NOWHERE
    for cell in range(reach.shape[1]):
        if tile_at(spec, cell) != COUNTER or state[CELLS + cell] != NOTHING or costs[cell] < 0:
            continue
        if reach[1 - seat, cell] == shared and (best == NOWHERE or costs[cell] < costs[best]):
            best = cell
    return best


@lean_kernel
def source_of(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    thing: int, unshared: bool,
) -> int:  # fmt: skip
    """The nearest place to get a thing; with `unshared`, not from a counter that the other chef reaches."""
    best = NOWHERE
    for cell in range(reach.shape[1]):
        if costs[cell] < 0:
            continue
        tile = tile_at(spec, cell)
        gives = tile == COUNTER and state[CELLS + cell] == thing and not (unshared and reach[1 - seat, cell])
        if thing <= DISH:
            gives = gives or tile == dispenser_of(thing)
        if gives and (best == NOWHERE or costs[cell] < costs[best]):
            best = cell
    return best


@lean_kernel
def nearest_cell(spec: NDArray[int16], costs: NDArray[int16], tile: int) -> int:
    """The nearest tile of a code."""
    best = NOWHERE
    for cell in range(costs.size):
        if (
            costs[cell] >= 0
            and tile_at(spec, cell) == tile
            and (best == NOWHERE or costs[cell] < costs[best])
        ):
            best = cell
    return best


@lean_kernel
def together(reach: NDArray[bool_]) -> bool:
    """Whether both chefs reach the same tiles."""
    same = True
    for cell in range(reach.shape[1]):
        same = same and reach[0, cell] == reach[1, cell]
    return same


@lean_kernel
def drop_at(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int
) -> int:
    """Where to put a thing of no use: the nearest empty counter, an unshared one if chefs are apart."""
    apart = free_counter(spec, state, reach, costs, seat, False)
    shared = free_counter(spec, state, reach, costs, seat, True)
    if apart == NOWHERE or shared == NOWHERE:
        return max(apart, shared)
    if together(reach) and costs[shared] < costs[apart]:
        return shared
    return apart
