"""The myopic human's decision, compiled: one kernel. `myopic.py` says what it does and why."""

from __future__ import annotations

from numpy import bool_, int16
from numpy.typing import NDArray

from galley.compiled.kernels import lean_kernel
from galley.kitchen.codes import (
    CELL,
    CELLS,
    CHEF,
    DISH,
    FACING,
    FLOOR,
    HELD,
    INTERACT,
    NOTHING,
    ONION,
    POT,
    SERVING,
    SPEC_ORDERS,
    SPEC_WIDTH,
    STAY,
    TOMATO,
)
from galley.kitchen.pots import is_soup, soup_of, ticks_left
from galley.kitchen.rules.shared import ahead
from galley.planning.kernels.needs_kernel import (
    NOWHERE,
    dispenser_of,
    drop_at,
    free_counter,
    must_pass,
    nearest_cell,
    need_of,
    open_order,
    pot_room,
    reaches_tile,
    source_of,
    tile_at,
    together,
    wanted_kind,
)

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
            soup = source_of(spec, state, reach, costs, seat, soup_of(kind), not serves)
            if soup != NOWHERE:
                return soup
    room = free_counter(spec, state, reach, costs, seat, True) != NOWHERE
    on_its_way = state[CHEF * other + HELD] == DISH
    if need_of(spec, state, reach, seat, DISH, wanted, -1) > on_its_way:
        dish = source_of(spec, state, reach, costs, seat, DISH, False)
        if dish != NOWHERE:
            return dish
    if room and must_pass(spec, state, reach, seat, DISH, wanted):
        dish = source_of(spec, state, reach, costs, seat, DISH, True)
        if dish != NOWHERE:
            return dish
    best = NOWHERE
    for kind in (ONION, TOMATO):
        own = need_of(spec, state, reach, seat, kind, wanted, -1) > 0
        if own or (room and must_pass(spec, state, reach, seat, kind, wanted)):
            found = source_of(spec, state, reach, costs, seat, kind, not own)
            if found != NOWHERE and (best == NOWHERE or costs[found] < costs[best]):
                best = found
    if best != NOWHERE or room or together(reach):
        return best
    # Nothing to do, and no shared counter free to get what is missing: clear one of the other's things away.
    if free_counter(spec, state, reach, costs, seat, False) == NOWHERE:
        return NOWHERE
    for thing in (ONION, TOMATO, DISH):
        if not reaches_tile(spec, reach, seat, dispenser_of(thing)):
            found = source_of(spec, state, reach, costs, seat, thing, False)
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
        if costs[cell] < 0 or tile_at(spec, cell) != POT:
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
        if costs[cell] < 0 or tile_at(spec, cell) != POT:
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
    serving = nearest_cell(spec, costs, SERVING)
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
        if tile_at(spec, goal) == POT and is_soup(packed) and ticks_left(spec, packed) > 0:
            return STAY
        return INTERACT
    for action in range(STAY):
        there = ahead(cell, action, int(spec[SPEC_WIDTH]))
        ends = there if tile_at(spec, there) == FLOOR else cell
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
        if tile_at(spec, there) == FLOOR and there != other:
            free += move != back
            back_is_free = back_is_free or move == back
    if free == 0:
        return back if back_is_free else NOWHERE
    left = int(draw * free)
    for move in range(STAY):
        there = ahead(cell, move, width)
        if move != back and tile_at(spec, there) == FLOOR and there != other:
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
