"""The myopic human's decision, compiled: one kernel. `myopic.py` says what it does and why."""

from __future__ import annotations

from numpy import bool_, int16
from numpy.typing import NDArray

from galley.compiled.kernels import lean_kernel
from galley.kitchen.codes import (
    CELL,
    CELLS,
    CHEF,
    COUNTER,
    DISH,
    DISH_DISPENSER,
    FACING,
    FLOOR,
    HELD,
    INGREDIENTS_PER_SOUP,
    INTERACT,
    NOTHING,
    ONION,
    ONION_DISPENSER,
    ONION_SOUP,
    ORDERS_DELIVERED,
    POT,
    SERVING,
    SPEC_HEIGHT,
    SPEC_ORDERS,
    SPEC_POTS,
    SPEC_TILES,
    SPEC_WIDTH,
    STAY,
    TOMATO,
    TOMATO_DISPENSER,
)
from galley.kitchen.pots import amount_in, is_all, is_soup, recipe_in, recipe_of_thing, soup_of, ticks_left
from galley.kitchen.rules.shared import ahead

# What the chef remembers of the tick before, int16 [MEMORY_SIZE].
KNOWN = 0
OWN_CELL = 1
OWN_FACING = 2
OWN_ACTION = 3
OTHER_CELL = 4
OTHER_ACTION = 5
WANDERS = 6  # random moves still to make, once stuck
MEMORY_SIZE = 7

MOST_WANDERS = 4
"""A stuck chef makes 1 to this many random moves in a row, so that two in a corridor get past each other."""

NOWHERE = -1


@lean_kernel
def _tile(spec: NDArray[int16], cell: int) -> int:
    return int(spec[SPEC_TILES + cell])


@lean_kernel
def _dispenser_of(thing: int) -> int:
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
def _lying(state: NDArray[int16], spec: NDArray[int16], reach: NDArray[bool_], seat: int, thing: int) -> int:
    """How many of a thing lie on counters that a seat can reach."""
    count = 0
    for cell in range(reach.shape[1]):
        if reach[seat, cell] and _tile(spec, cell) == COUNTER and state[CELLS + cell] == thing:
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
        if _tile(spec, cell) == POT:
            recipe = recipe_in(int(state[CELLS + cell]))
        elif _tile(spec, cell) == COUNTER and state[CELLS + cell] >= ONION_SOUP:
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
        if _tile(spec, cell) != POT or not reach[seat, cell] or (not_for >= 0 and reach[not_for, cell]):
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
    if need == 0 or reaches_tile(spec, reach, other, _dispenser_of(thing)):
        return False
    return bool(need > _lying(state, spec, reach, other, thing) + (state[CHEF * other + HELD] == thing))


@lean_kernel
def free_counter(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    shared: bool,
) -> int:  # fmt: skip
    """The nearest empty counter, one that the other chef reaches too or one that it does not."""
    best = NOWHERE
    for cell in range(reach.shape[1]):
        if _tile(spec, cell) != COUNTER or state[CELLS + cell] != NOTHING or costs[cell] < 0:
            continue
        if reach[1 - seat, cell] == shared and (best == NOWHERE or costs[cell] < costs[best]):
            best = cell
    return best


@lean_kernel
def _source(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    thing: int, unshared: bool,
) -> int:  # fmt: skip
    """The nearest place to get a thing; with `unshared`, not from a counter that the other chef reaches."""
    best = NOWHERE
    for cell in range(reach.shape[1]):
        if costs[cell] < 0:
            continue
        tile = _tile(spec, cell)
        gives = tile == COUNTER and state[CELLS + cell] == thing and not (unshared and reach[1 - seat, cell])
        if thing <= DISH:
            gives = gives or tile == _dispenser_of(thing)
        if gives and (best == NOWHERE or costs[cell] < costs[best]):
            best = cell
    return best


@lean_kernel
def _nearest(spec: NDArray[int16], costs: NDArray[int16], tile: int) -> int:
    """The nearest tile of a code."""
    best = NOWHERE
    for cell in range(costs.size):
        if costs[cell] >= 0 and _tile(spec, cell) == tile and (best == NOWHERE or costs[cell] < costs[best]):
            best = cell
    return best


@lean_kernel
def drop_at(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int
) -> int:
    """Where to put a thing of no use: the nearest empty counter, an unshared one if chefs are apart."""
    apart = free_counter(spec, state, reach, costs, seat, False)
    shared = free_counter(spec, state, reach, costs, seat, True)
    if apart == NOWHERE or shared == NOWHERE:
        return max(apart, shared)
    if _together(reach) and costs[shared] < costs[apart]:
        return shared
    return apart


@lean_kernel
def _together(reach: NDArray[bool_]) -> bool:
    """Whether both chefs reach the same tiles."""
    same = True
    for cell in range(reach.shape[1]):
        same = same and reach[0, cell] == reach[1, cell]
    return same


@lean_kernel
def _empty_handed(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    wanted: int,
) -> int:  # fmt: skip
    """Where a chef who holds nothing should interact."""
    other = 1 - seat
    serves = reaches_tile(spec, reach, seat, SERVING)
    for kind in (ONION, TOMATO):
        ordered = spec[SPEC_ORDERS] == 0 or open_order(spec, state, 0) == kind
        if ordered and (serves or reaches_tile(spec, reach, other, SERVING)):
            soup = _source(spec, state, reach, costs, seat, soup_of(kind), not serves)
            if soup != NOWHERE:
                return soup
    room = free_counter(spec, state, reach, costs, seat, True) != NOWHERE
    on_its_way = state[CHEF * other + HELD] == DISH
    if need_of(spec, state, reach, seat, DISH, wanted, -1) > on_its_way:
        dish = _source(spec, state, reach, costs, seat, DISH, False)
        if dish != NOWHERE:
            return dish
    if room and must_pass(spec, state, reach, seat, DISH, wanted):
        dish = _source(spec, state, reach, costs, seat, DISH, True)
        if dish != NOWHERE:
            return dish
    best = NOWHERE
    for kind in (ONION, TOMATO):
        own = need_of(spec, state, reach, seat, kind, wanted, -1) > 0
        if own or (room and must_pass(spec, state, reach, seat, kind, wanted)):
            found = _source(spec, state, reach, costs, seat, kind, not own)
            if found != NOWHERE and (best == NOWHERE or costs[found] < costs[best]):
                best = found
    if best != NOWHERE or room or _together(reach):
        return best
    # Nothing to do, and no shared counter free to get what is missing: clear one of the other's things away.
    if free_counter(spec, state, reach, costs, seat, False) == NOWHERE:
        return NOWHERE
    for thing in (ONION, TOMATO, DISH):
        if not reaches_tile(spec, reach, seat, _dispenser_of(thing)):
            found = _source(spec, state, reach, costs, seat, thing, False)
            if found != NOWHERE and reach[other, found]:
                return found
    return NOWHERE


@lean_kernel
def _holding_ingredient(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    wanted: int,
) -> int:  # fmt: skip
    """Where a chef who holds an onion or a tomato should interact."""
    held = int(state[CHEF * seat + HELD])
    best = NOWHERE
    for cell in range(costs.size):
        if costs[cell] < 0 or _tile(spec, cell) != POT:
            continue
        room = pot_room(int(state[CELLS + cell]), wanted, held, spec[SPEC_ORDERS] == 0)
        if room > 0 and (best == NOWHERE or costs[cell] < costs[best]):
            best = cell
    if best != NOWHERE:
        return best
    if must_pass(spec, state, reach, seat, held, wanted):
        return free_counter(spec, state, reach, costs, seat, True)
    return drop_at(spec, state, reach, costs, seat)


@lean_kernel
def _holding_dish(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    wanted: int,
) -> int:  # fmt: skip
    """Where a chef who holds a dish should interact: the pot where it has a soup soonest."""
    best = NOWHERE
    soonest = 0
    for cell in range(costs.size):
        if costs[cell] < 0 or _tile(spec, cell) != POT:
            continue
        packed = int(state[CELLS + cell])
        if is_soup(packed):
            soon = max(int(costs[cell]), ticks_left(spec, packed))
            if best == NOWHERE or soon < soonest:
                best, soonest = cell, soon
    if best != NOWHERE:
        return best
    if must_pass(spec, state, reach, seat, DISH, wanted):
        return free_counter(spec, state, reach, costs, seat, True)
    return drop_at(spec, state, reach, costs, seat)


@lean_kernel
def _holding_soup(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int
) -> int:
    """Where a chef who holds a soup should interact; a soup that is ordered later is put down until then."""
    held = state[CHEF * seat + HELD]
    if spec[SPEC_ORDERS] > 0 and soup_of(open_order(spec, state, 0)) != held:
        for later in range(1, spec[SPEC_ORDERS]):
            if soup_of(open_order(spec, state, later)) == held:
                return drop_at(spec, state, reach, costs, seat)
    serving = _nearest(spec, costs, SERVING)
    if serving != NOWHERE or not reaches_tile(spec, reach, 1 - seat, SERVING):
        return serving
    return free_counter(spec, state, reach, costs, seat, True)


@lean_kernel
def target(
    spec: NDArray[int16], all_costs: NDArray[int16], reach: NDArray[bool_], state: NDArray[int16], seat: int
) -> int:
    """The cell of the tile that the chef's subtask is at, or NOWHERE when there is nothing to do."""
    chef = CHEF * seat
    costs = all_costs[state[chef + CELL] * 4 + state[chef + FACING]]
    held = state[chef + HELD]
    wanted = wanted_kind(spec, state, reach)
    if held == NOTHING:
        return _empty_handed(spec, state, reach, costs, seat, wanted)
    if held == DISH:
        return _holding_dish(spec, state, reach, costs, seat, wanted)
    if held < DISH:
        return _holding_ingredient(spec, state, reach, costs, seat, wanted)
    return _holding_soup(spec, state, reach, costs, seat)


@lean_kernel
def _planned(
    spec: NDArray[int16], all_costs: NDArray[int16], reach: NDArray[bool_], state: NDArray[int16], seat: int
) -> int:
    """The first action of a shortest way to the subtask, the first of equals; to stay when there is none."""
    goal = target(spec, all_costs, reach, state, seat)
    if goal == NOWHERE:
        return STAY
    cell = int(state[CHEF * seat + CELL])
    cost = all_costs[cell * 4 + state[CHEF * seat + FACING], goal]
    if cost == 0:
        packed = int(state[CELLS + goal])
        if _tile(spec, goal) == POT and is_soup(packed) and ticks_left(spec, packed) > 0:
            return STAY
        return INTERACT
    for action in range(STAY):
        there = ahead(cell, action, int(spec[SPEC_WIDTH]))
        ends = there if _tile(spec, there) == FLOOR else cell
        if all_costs[ends * 4 + action, goal] == cost - 1:
            return action
    return STAY


@lean_kernel
def stuck(state: NDArray[int16], seat: int, memory: NDArray[int16]) -> bool:
    """Whether the chef's last move changed neither its cell nor its facing."""
    chef = CHEF * seat
    tried = memory[KNOWN] and memory[OWN_ACTION] < STAY
    same = state[chef + CELL] == memory[OWN_CELL] and state[chef + FACING] == memory[OWN_FACING]
    return bool(tried and same)


@lean_kernel
def _in_the_way(spec: NDArray[int16], state: NDArray[int16], seat: int, memory: NDArray[int16]) -> bool:
    """Whether the other chef's last move failed because this one stood there."""
    other = state[CHEF * (1 - seat) + CELL]
    asked = memory[OTHER_ACTION]
    if not memory[KNOWN] or asked >= STAY or other != memory[OTHER_CELL]:
        return False
    return bool(ahead(int(other), int(asked), int(spec[SPEC_WIDTH])) == state[CHEF * seat + CELL])


@lean_kernel
def wander(spec: NDArray[int16], state: NDArray[int16], seat: int, back: int, draw: float) -> int:
    """A random move to a free cell, `back` only if there is no other; NOWHERE if there is none."""
    cell = int(state[CHEF * seat + CELL])
    other = state[CHEF * (1 - seat) + CELL]
    width = int(spec[SPEC_WIDTH])
    free = 0
    back_is_free = False
    for move in range(STAY):
        there = ahead(cell, move, width)
        if _tile(spec, there) == FLOOR and there != other:
            free += move != back
            back_is_free = back_is_free or move == back
    if free == 0:
        return back if back_is_free else NOWHERE
    left = int(draw * free)
    for move in range(STAY):
        there = ahead(cell, move, width)
        if move != back and _tile(spec, there) == FLOOR and there != other:
            if left == 0:
                return move
            left -= 1
    return NOWHERE


@lean_kernel
def decide(
    spec: NDArray[int16], all_costs: NDArray[int16], reach: NDArray[bool_], state: NDArray[int16], seat: int,
    memory: NDArray[int16], draw: float,
) -> int:  # fmt: skip
    """The action of the myopic human on `seat`; `draw` in [0, 1) settles a random move."""
    action = _planned(spec, all_costs, reach, state, seat)
    if action == INTERACT:
        return action
    back = NOWHERE
    if action < STAY:
        if not stuck(state, seat, memory):
            if memory[WANDERS] == 0:
                return action
            if memory[OWN_ACTION] < STAY:
                back = memory[OWN_ACTION] ^ 1  # the codes of opposite moves differ in the last bit
    elif not _in_the_way(spec, state, seat, memory):
        return action
    move = wander(spec, state, seat, back, draw)
    return action if move == NOWHERE else move


@lean_kernel
def remember(
    state: NDArray[int16], seat: int, memory: NDArray[int16], own_action: int, other_action: int, draw: float
) -> None:
    """Note in `memory` what both did in `state`; `draw` in [0, 1): how long the stuck wander."""
    if stuck(state, seat, memory):
        memory[WANDERS] = int(draw * MOST_WANDERS)
    elif memory[WANDERS] > 0:
        memory[WANDERS] -= 1
    memory[KNOWN] = 1
    memory[OWN_CELL] = state[CHEF * seat + CELL]
    memory[OWN_FACING] = state[CHEF * seat + FACING]
    memory[OWN_ACTION] = own_action
    memory[OTHER_CELL] = state[CHEF * (1 - seat) + CELL]
    memory[OTHER_ACTION] = other_action
