"""What a team may do next and how long the rest is likely to take, compiled: the plan search's estimates."""

from __future__ import annotations

import numpy as np
from numpy import int16
from numpy.typing import NDArray

from galley.compiled.kernels import lean_kernel
from galley.kitchen.codes import (
    CELL,
    CELLS,
    CHEF,
    COUNTER,
    DISH,
    FACING,
    HELD,
    INGREDIENTS_PER_SOUP,
    NOTHING,
    ONION,
    ONION_SOUP,
    POT,
    SERVING,
    SPEC_COOK_TIMES,
    SPEC_ORDERS,
    SPEC_TILES,
    TOMATO,
)
from galley.kitchen.pots import amount_in, is_soup, soup_of, whole_soup
from galley.planning.kernels.joint_kernel import FAR
from galley.planning.kernels.needs_kernel import open_order, pot_room, wanted_kind
from galley.planning.kernels.robot_kernel import Brain, cooks_for, task_of, way_alone, world_of
from galley.planning.kernels.subtask_kernel import (
    DELIVER,
    DROP,
    FETCH,
    FILL,
    KINDS,
    TAKE_DISH,
    TAKE_ONION,
    TAKE_SOUP,
    TAKE_TOMATO,
    WAIT,
    add_sources,
    add_tile,
)
from galley.planning.kernels.value_kernel import MOST_ORDERS, both_busy

STRANDED_TICKS = 500.0
"""The cost to go of a state in which neither chef has anything to do."""
STAGE_TICKS = 3.5
"""What a step on a thing's way from dispenser to pot is taken to cost where things pass over counters."""


@lean_kernel
def _pass_counters(
    brain: Brain, state: NDArray[int16], seat: int, out: NDArray[int16], summed: NDArray[int16]
) -> None:
    """Add the empty counters that both reach with the least way for both together."""
    chef = CHEF * seat
    other = CHEF * (1 - seat)
    own = brain.costs[4 * state[chef + CELL] + state[chef + FACING]]
    theirs = brain.costs[4 * state[other + CELL] + state[other + FACING]]
    for cell in range(own.size):
        summed[cell] = -1
        if own[cell] >= 0 and theirs[cell] >= 0:
            summed[cell] = own[cell] + theirs[cell]
            if brain.passing[cell] and state[CELLS + cell] == NOTHING:
                add_tile(out, DROP, cell, summed)


@lean_kernel
def team_options(
    brain: Brain, state: NDArray[int16], seat: int, orders: int, thorough: bool, out: NDArray[int16],
    summed: NDArray[int16],
) -> None:  # fmt: skip
    """Fill `out` int16[KINDS, 4] as `subtasks` does, with all that may help to `orders` more soups.

    A `thorough` search has more to try: dishes before a pot is begun, waiting beside a pot that is not full,
    both chefs after the last ingredient. In a narrow beam these crowd out better plans.
    """
    out[:] = 0
    spec, reach = brain.spec, brain.reach
    chef = CHEF * seat
    costs = brain.costs[4 * state[chef + CELL] + state[chef + FACING]]
    held = int(state[chef + HELD])
    others = state[CHEF * (1 - seat) + HELD]
    wanted = wanted_kind(spec, state, reach)
    any_order = spec[SPEC_ORDERS] == 0
    soups = 0  # made or being made
    begun = 0
    dishes = int(others == DISH)
    if others >= ONION_SOUP:
        soups += 1
    onion_room = 0
    tomato_room = 0
    for cell in range(costs.size):
        tile = spec[SPEC_TILES + cell]
        packed = int(state[CELLS + cell])
        if tile == POT:
            begun += packed > 0
            if is_soup(packed):
                soups += 1
                packed = 0  # the next soup's ingredients may be taken ahead
            onion_room += pot_room(packed, wanted, ONION, any_order)
            tomato_room += pot_room(packed, wanted, TOMATO, any_order)
        elif tile == COUNTER and packed >= ONION_SOUP:
            soups += 1
    if held == NOTHING:
        for kind in (ONION, TOMATO):
            if any_order or open_order(spec, state, 0) == kind:
                add_sources(spec, state, reach, costs, seat, soup_of(kind), False, TAKE_SOUP, out)
        if (max(begun, 1) if thorough else begun) > dishes:
            add_sources(spec, state, reach, costs, seat, DISH, False, TAKE_DISH, out)
        for kind in (ONION, TOMATO):
            room = onion_room if kind == ONION else tomato_room
            if room > (others == kind and not thorough) and soups < orders:
                add_sources(
                    spec, state, reach, costs, seat, kind, False,
                    TAKE_ONION if kind == ONION else TAKE_TOMATO, out,
                )  # fmt: skip
        return
    for cell in range(costs.size):
        tile = spec[SPEC_TILES + cell]
        packed = int(state[CELLS + cell])
        if held == DISH:
            if tile == POT and (is_soup(packed) or thorough):  # who is early waits beside it
                add_tile(out, FETCH, cell, costs)
        elif held > DISH:
            if tile == SERVING and (any_order or soup_of(open_order(spec, state, 0)) == held):
                add_tile(out, DELIVER, cell, costs)
        elif tile == POT:
            if is_soup(packed):
                packed = 0  # who is early waits beside it
            if pot_room(packed, wanted, held, any_order) > 0:
                add_tile(out, FILL, cell, costs)
    _pass_counters(brain, state, seat, out, summed)
    if out[DROP, 0] == 0:
        for cell in range(costs.size):
            if spec[SPEC_TILES + cell] == COUNTER and state[CELLS + cell] == NOTHING:
                add_tile(out, DROP, cell, costs)


@lean_kernel
def _left(brain: Brain, state: NDArray[int16], seat: int, cell: int) -> float:
    """The ticks that a chef alone needs to do something useful with the tile at `cell`."""
    wait = cooks_for(brain, state, cell)
    if must_wait(brain, state, seat, cell):
        wait += 1
    return float(max(way_alone(brain, state, seat, cell), wait) + 1)


@lean_kernel
def must_wait(brain: Brain, state: NDArray[int16], seat: int, cell: int) -> bool:
    """Whether interacting with the tile does nothing yet: a soup still cooks, or a pot is still full."""
    if brain.spec[SPEC_TILES + cell] != POT:
        return False
    full = is_soup(int(state[CELLS + cell]))
    if state[CHEF * seat + HELD] == DISH:
        return not full or cooks_for(brain, state, cell) > 0
    return bool(full)


@lean_kernel
def _stages(brain: Brain, state: NDArray[int16], orders: int) -> float:
    """A cost to go where things pass over counters: the steps left on the way of each thing needed."""
    spec = brain.spec
    ingredients = 0
    stages = 0.0
    shared_ingredients = 0
    shared_dishes = 0
    soups = 0  # out of the pot
    in_pots = 0
    cooking = 0
    inside = 0
    for cell in range(brain.reach.shape[1]):
        tile = spec[SPEC_TILES + cell]
        packed = int(state[CELLS + cell])
        if tile == POT:
            if is_soup(packed):
                in_pots += 1
                cooking = max(cooking, cooks_for(brain, state, cell))
            else:
                inside += amount_in(packed)
        elif tile == COUNTER and packed != NOTHING:
            shared = brain.reach[0, cell] and brain.reach[1, cell]
            if packed >= ONION_SOUP:
                soups += 1
                stages += 2
            elif shared and packed == DISH:
                shared_dishes += 1
            elif shared:
                shared_ingredients += 1
    near = 0.0
    hands_ingredients = 0.0
    hands_dishes = 0.0
    for seat in range(2):
        held = state[CHEF * seat + HELD]
        station = -1
        if held >= ONION_SOUP:
            soups += 1
            stages += 1
            station = SERVING
        elif held != NOTHING:
            station = POT
        best = FAR
        for cell in range(brain.reach.shape[1]):
            if spec[SPEC_TILES + cell] == station:
                cost = way_alone(brain, state, seat, cell)
                if cost >= 0:
                    best = min(best, cost)
        reaches = best < FAR
        if held == DISH:
            hands_dishes += 1 if reaches else 0.34
        elif held in (ONION, TOMATO):
            hands_ingredients += 1 if reaches else 0.34
        if reaches:
            near += 0.05 * best
    made = soups + in_pots
    ingredients = max(0, orders - made) * INGREDIENTS_PER_SOUP - inside
    plates = max(0, orders - soups)
    stages += 4 * ingredients - 2 * min(ingredients, shared_ingredients) - 3 * hands_ingredients
    stages += 4 * plates - 2 * min(plates, shared_dishes) - 3 * hands_dishes
    stages += plates  # to deliver what is then fetched
    last = float(cooking)
    if ingredients > 0:
        last = float(spec[SPEC_COOK_TIMES + whole_soup(ONION)]) + 2 * STAGE_TICKS
    return max(stages * STAGE_TICKS / 2 + near, last)


@lean_kernel
def to_go(
    brain: Brain, state: NDArray[int16], orders: int, beyond: int, thorough: bool, options: NDArray[int16],
    summed: NDArray[int16],
) -> float:  # fmt: skip
    """The estimated ticks until `orders` + `beyond` more soups are served; fills `options` [2, KINDS, 4]."""
    orders += beyond
    team_options(brain, state, 0, orders, thorough, options[0], summed)
    team_options(brain, state, 1, orders, thorough, options[1], summed)
    if brain.pots[1]:
        return _stages(brain, state, orders)
    best = np.inf
    for kind0 in range(KINDS):
        if kind0 != WAIT and options[0, kind0, 0] == 0:
            continue
        for kind1 in range(KINDS):
            if (kind1 != WAIT and options[1, kind1, 0] == 0) or (kind0 == WAIT and kind1 == WAIT):
                continue
            cost = pair_to_go(
                brain, state, orders, kind0, options[0, kind0, 1], kind1, options[1, kind1, 1], 0
            )
            best = min(best, cost)
    return best if best < np.inf else STRANDED_TICKS


@lean_kernel
def pair_to_go(
    brain: Brain,
    state: NDArray[int16],
    orders: int,
    kind0: int,
    cell0: int,
    kind1: int,
    cell1: int,
    delay: int,
) -> float:
    """The estimated ticks until `orders` more soups are served if the chefs now take up these subtasks."""
    at = world_of(brain.spec, state, kind0 == TAKE_SOUP or kind1 == TAKE_SOUP)
    ahead = min(MOST_ORDERS, max(1, orders))
    at = at // MOST_ORDERS * MOST_ORDERS + ahead - 1
    left0 = 0.0 if kind0 == WAIT else _left(brain, state, 0, cell0)
    left1 = 0.0 if kind1 == WAIT else _left(brain, state, 1, cell1)
    if kind0 == WAIT:
        left0 = left1 + 1
    if kind1 == WAIT:
        left1 = left0 + 1
    return both_busy(
        task_of(kind0), left0 + delay, task_of(kind1), left1 + delay, at, int(brain.pots[0]), brain.unit[0],
        brain.robot_next, brain.human_next,
    )  # fmt: skip
