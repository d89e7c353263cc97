"""The rules of the kitchen, rule set `classic`; with `shared.py` the only place that changes its state.

Source: Carroll et al. 2019 (Overcooked-AI as of that year), the rules of the COLE and LSI papers;
checked against 91,102 recorded human transitions (`tests/datasets/test_overcooked_games.py`).

Numbers read from an array become `int` before they are shifted or multiplied, so that the same code is right
as plain Python too (`NUMBA_DISABLE_JIT=1`), where sums of int16 stay int16.
"""

from __future__ import annotations

from numpy import int16, int32
from numpy.typing import NDArray

from galley.compiled.kernels import lean_kernel
from galley.kitchen.codes import (
    BIT_BLOCKED,
    BIT_DELIVER,
    BIT_FETCH,
    BIT_PAID,
    BIT_POT,
    BIT_USEFUL_DISH,
    CELL,
    CELLS,
    CHEF,
    COUNTER,
    DELIVERIES,
    DISH,
    DISH_DISPENSER,
    FACING,
    FLOOR,
    HELD,
    INGREDIENTS_PER_SOUP,
    INTERACT,
    NOTHING,
    ONION,
    ONION_SOUP,
    ORDERS_DELIVERED,
    OUT_EVENTS,
    OUT_READY,
    OUT_REWARD,
    POT,
    POT_TICKS,
    SERVING,
    SPEC_HEIGHT,
    SPEC_ORDERS,
    SPEC_POTS,
    SPEC_PRICES,
    SPEC_TILES,
    SPEC_WIDTH,
    TICK,
    TOMATO,
)
from galley.kitchen.pots import (
    amount_in,
    is_all,
    is_soup,
    recipe_all,
    recipe_in,
    recipe_of_thing,
    thing_of,
    ticks_left,
)
from galley.kitchen.rules.shared import ahead, all_delivered, move, use_counter, use_dispenser


@lean_kernel
def _pots_in_use(spec: NDArray[int16], state: NDArray[int16]) -> int:
    """How many pots are partly full, cooking or ready."""
    first = SPEC_TILES + spec[SPEC_WIDTH] * spec[SPEC_HEIGHT]
    count = 0
    for pot in range(spec[SPEC_POTS]):
        if state[CELLS + spec[first + pot]] != 0:
            count += 1
    return count


@lean_kernel
def _dish_is_useful(spec: NDArray[int16], state: NDArray[int16], pots_in_use: int) -> bool:
    """Whether taking a dish helps: none lies on a counter and fewer are held than pots are in use.

    Source: Carroll et al. 2019, `is_dish_pickup_useful`; the pots count as they were when the tick began.
    """
    held = 0
    for seat in range(2):
        if state[CHEF * seat + HELD] == DISH:
            held += 1
    if held >= pots_in_use:
        return False
    for cell in range(spec[SPEC_WIDTH] * spec[SPEC_HEIGHT]):
        if state[CELLS + cell] == DISH and spec[SPEC_TILES + cell] == COUNTER:
            return False
    return True


@lean_kernel
def _deliver(spec: NDArray[int16], state: NDArray[int16], recipe: int) -> bool:
    """Whether the delivered soup pays; a soup that matches the first open order closes that order."""
    orders = spec[SPEC_ORDERS]
    if orders > 0:
        done = state[ORDERS_DELIVERED]
        first = SPEC_TILES + spec[SPEC_WIDTH] * spec[SPEC_HEIGHT] + spec[SPEC_POTS]
        if spec[first + done] != recipe:
            return False
        state[ORDERS_DELIVERED] += 1
    state[DELIVERIES] += 1
    return True


@lean_kernel
def _use_pot(spec: NDArray[int16], state: NDArray[int16], hand: int, slot: int) -> int:
    """The event mask of a chef who interacts with the pot at `slot` of the state: it takes one kind only."""
    held = int(state[hand])
    pot = int(state[slot])
    if held in (ONION, TOMATO):
        amount = amount_in(pot)
        if amount == 0 or (is_all(pot, held) and amount < INGREDIENTS_PER_SOUP):
            state[slot] = recipe_all(held, amount + 1)
            state[hand] = NOTHING
            return 1 << (BIT_POT + held - ONION)
    elif held == DISH and is_soup(pot) and ticks_left(spec, pot) <= 0:
        soup = thing_of(recipe_in(pot))
        state[slot] = 0
        state[hand] = soup
        return 1 << (BIT_FETCH + soup - ONION_SOUP)
    return 0


@lean_kernel
def _interact(spec: NDArray[int16], state: NDArray[int16], chef: int, pots_in_use: int) -> tuple[int, int]:
    """The event mask and the reward of the chef at `chef` of the state, who uses the tile it faces."""
    target = ahead(int(state[chef + CELL]), int(state[chef + FACING]), int(spec[SPEC_WIDTH]))
    tile = int(spec[SPEC_TILES + target])
    if tile == FLOOR:
        return 0, 0
    hand = chef + HELD
    slot = CELLS + target
    if tile == COUNTER:
        return use_counter(state, hand, slot), 0
    if tile == POT:
        return _use_pot(spec, state, hand, slot), 0
    if tile == SERVING:
        held = int(state[hand])
        if held < ONION_SOUP:
            return 0, 0
        state[hand] = NOTHING
        events = 1 << (BIT_DELIVER + held - ONION_SOUP)
        recipe = recipe_of_thing(held)
        if _deliver(spec, state, recipe):
            return events | 1 << BIT_PAID, int(spec[SPEC_PRICES + recipe])
        return events, 0
    useful = state[hand] == NOTHING and tile == DISH_DISPENSER and _dish_is_useful(spec, state, pots_in_use)
    events = use_dispenser(state, hand, tile)
    return (events | 1 << BIT_USEFUL_DISH if useful else events), 0


@lean_kernel
def classic_step(spec: NDArray[int16], state: NDArray[int16], a0: int, a1: int, out: NDArray[int32]) -> int:
    """The reward of one tick of a kitchen that is not finished: see `galley.kitchen.rules.tick.step`."""
    events0 = 0
    events1 = 0
    reward = 0

    # 1. Interactions, seat 0 first, each on the tile faced before anyone moves. Once the last order is
    # delivered no more of them count.
    if a0 == INTERACT or a1 == INTERACT:
        pots_in_use = _pots_in_use(spec, state)
        if a0 == INTERACT:
            events0, reward = _interact(spec, state, 0, pots_in_use)
        if a1 == INTERACT and not all_delivered(spec, state):
            events1, paid = _interact(spec, state, CHEF, pots_in_use)
            reward += paid

    # 2. Movement, both at once.
    blocked0, blocked1 = move(spec, state, a0, a1)
    if blocked0:
        events0 |= 1 << BIT_BLOCKED
    if blocked1:
        events1 |= 1 << BIT_BLOCKED

    # 3. Cooking: a full pot cooks by itself; the tick that filled it counts.
    ready = 0
    first_pot = SPEC_TILES + spec[SPEC_WIDTH] * spec[SPEC_HEIGHT]
    for number in range(spec[SPEC_POTS]):
        slot = CELLS + spec[first_pot + number]
        pot = int(state[slot])
        if is_soup(pot):
            left = ticks_left(spec, pot)
            if left > 0:
                state[slot] = pot + POT_TICKS
                if left == 1:
                    ready |= 1 << number

    state[TICK] += 1
    out[OUT_REWARD] = reward
    out[OUT_EVENTS] = events0
    out[OUT_EVENTS + 1] = events1
    out[OUT_READY] = ready
    return reward
