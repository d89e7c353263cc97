"""The rules of the kitchen, rule set `classic`: the only place that changes a kitchen's state.

A single kitchen and a batch share `step`.

Source: Carroll et al. 2019 (Overcooked-AI as of that year), the rules of the COLE and LSI papers;
checked against 91,102 recorded human transitions (`tests/datasets/test_overcooked_games.py`).

Numbers read from an array become `int` before they are shifted or multiplied, so that the same code is right
as plain Python too (`NUMBA_DISABLE_JIT=1`), where sums of int16 stay int16.
"""

from __future__ import annotations

from numpy import int16, int32, uint8
from numpy.typing import NDArray

from galley.compiled.kernels import kernel
from galley.kitchen.codes import (
    BIT_BLOCKED,
    BIT_DELIVER,
    BIT_FETCH,
    BIT_PAID,
    BIT_PICK_UP,
    BIT_POT,
    BIT_PUT_DOWN,
    BIT_TAKE,
    BIT_USEFUL_DISH,
    CELL,
    CELLS,
    CHEF,
    COUNTER,
    DELIVERIES,
    DISH,
    DISH_DISPENSER,
    EAST,
    FACING,
    FLOOR,
    HELD,
    INGREDIENTS_PER_SOUP,
    INTERACT,
    NORTH,
    NOTHING,
    ONION,
    ONION_DISPENSER,
    ONION_SOUP,
    ORDERS_DELIVERED,
    OUT_EVENTS,
    OUT_READY,
    OUT_REWARD,
    POT,
    POT_COUNT,
    POT_TICKS,
    SERVING,
    SOUP_OF_KIND,
    SOUTH,
    SPEC_COOK_TIME,
    SPEC_HEIGHT,
    SPEC_HORIZON,
    SPEC_ORDERS,
    SPEC_POTS,
    SPEC_REWARD,
    SPEC_STARTS,
    SPEC_TILES,
    SPEC_WIDTH,
    STAY,
    TICK,
    TOMATO,
    TOMATO_DISPENSER,
    TOMATO_SOUP,
)


@kernel
def reset(spec: NDArray[int16], state: NDArray[int16]) -> None:
    """Nothing; sets `state` int16[S] to the start: empty hands, facing north, nothing lying or cooking."""
    state[:] = 0
    state[CELL] = spec[SPEC_STARTS]
    state[CHEF + CELL] = spec[SPEC_STARTS + 1]


@kernel
def _all_delivered(spec: NDArray[int16], state: NDArray[int16]) -> bool:
    """Whether there is an order list and every order of it is delivered."""
    orders = spec[SPEC_ORDERS]
    return bool(orders > 0 and state[ORDERS_DELIVERED] >= orders)


@kernel
def finished(spec: NDArray[int16], state: NDArray[int16]) -> bool:
    """Whether the episode is over: at the horizon, or when every order of the list is delivered."""
    if state[TICK] >= spec[SPEC_HORIZON]:
        return True
    return _all_delivered(spec, state)


@kernel
def _ahead(cell: int, facing: int, width: int) -> int:
    """The cell index one step from `cell` towards `facing`."""
    if facing == NORTH:
        return cell - width
    if facing == SOUTH:
        return cell + width
    if facing == EAST:
        return cell + 1
    return cell - 1


@kernel
def _pots_in_use(spec: NDArray[int16], state: NDArray[int16]) -> int:
    """How many pots are partly full, cooking or ready."""
    first = SPEC_TILES + spec[SPEC_WIDTH] * spec[SPEC_HEIGHT]
    count = 0
    for pot in range(spec[SPEC_POTS]):
        if state[CELLS + spec[first + pot]] != 0:
            count += 1
    return count


@kernel
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


@kernel
def _deliver(spec: NDArray[int16], state: NDArray[int16], soup: int) -> bool:
    """Whether the delivered soup pays; a soup that matches the first open order closes that order."""
    orders = spec[SPEC_ORDERS]
    if orders > 0:
        done = state[ORDERS_DELIVERED]
        first = SPEC_TILES + spec[SPEC_WIDTH] * spec[SPEC_HEIGHT] + spec[SPEC_POTS]
        if spec[first + done] + SOUP_OF_KIND != soup:
            return False
        state[ORDERS_DELIVERED] += 1
    state[DELIVERIES] += 1
    return True


@kernel
def _use_pot(spec: NDArray[int16], state: NDArray[int16], hand: int, slot: int) -> int:
    """The event mask of a chef who interacts with the pot at `slot` of the state."""
    held = int(state[hand])
    pot = int(state[slot])
    kind = pot % POT_COUNT
    count = (pot // POT_COUNT) % POT_COUNT
    if held in (ONION, TOMATO):
        if count == 0 or (kind == held and count < INGREDIENTS_PER_SOUP):
            state[slot] = held + POT_COUNT * (count + 1)
            state[hand] = NOTHING
            return 1 << (BIT_POT + held - ONION)
    elif held == DISH and count == INGREDIENTS_PER_SOUP and pot // POT_TICKS >= spec[SPEC_COOK_TIME]:
        state[slot] = 0
        state[hand] = kind + SOUP_OF_KIND
        return 1 << (BIT_FETCH + kind - ONION)
    return 0


@kernel
def _interact(spec: NDArray[int16], state: NDArray[int16], chef: int, pots_in_use: int) -> int:
    """The event mask of the chef at `chef` of the state, who interacts with the tile it faces."""
    target = _ahead(int(state[chef + CELL]), int(state[chef + FACING]), int(spec[SPEC_WIDTH]))
    tile = spec[SPEC_TILES + target]
    if tile == FLOOR:
        return 0
    hand = chef + HELD
    held = int(state[hand])
    slot = CELLS + target
    if tile == COUNTER:
        lying = int(state[slot])
        if held != NOTHING and lying == NOTHING:
            state[slot] = held
            state[hand] = NOTHING
            return 1 << (BIT_PUT_DOWN + held - ONION)
        if held == NOTHING and lying != NOTHING:
            state[slot] = NOTHING
            state[hand] = lying
            return 1 << (BIT_PICK_UP + lying - ONION)
        return 0
    if tile == POT:
        return _use_pot(spec, state, hand, slot)
    if tile == SERVING:
        if held != ONION_SOUP and held != TOMATO_SOUP:
            return 0
        state[hand] = NOTHING
        events = 1 << (BIT_DELIVER + held - ONION_SOUP)
        if _deliver(spec, state, held):
            events |= 1 << BIT_PAID
        return events
    if held != NOTHING:
        return 0
    if tile == ONION_DISPENSER:
        thing = ONION
    elif tile == TOMATO_DISPENSER:
        thing = TOMATO
    else:
        thing = DISH
    events = 1 << (BIT_TAKE + thing - ONION)
    if tile == DISH_DISPENSER and _dish_is_useful(spec, state, pots_in_use):
        events |= 1 << BIT_USEFUL_DISH
    state[hand] = thing
    return events


@kernel
def step(spec: NDArray[int16], state: NDArray[int16], a0: int, a1: int, out: NDArray[int32]) -> int:
    """The reward of one tick; changes `state` int16[S] and fills `out` int32[4].

    `out` is reward, event mask of seat 0, event mask of seat 1, mask of the pots that became ready.
    A finished kitchen does not change and gives zeros.
    """
    if finished(spec, state):
        out[:] = 0
        return 0
    width = int(spec[SPEC_WIDTH])
    events0 = 0
    events1 = 0

    # 1. Interactions, seat 0 first, each on the tile faced before anyone moves. Once the last order is
    # delivered no more of them count.
    if a0 == INTERACT or a1 == INTERACT:
        pots_in_use = _pots_in_use(spec, state)
        if a0 == INTERACT:
            events0 = _interact(spec, state, 0, pots_in_use)
        if a1 == INTERACT and not _all_delivered(spec, state):
            events1 = _interact(spec, state, CHEF, pots_in_use)

    # 2. Movement, both at once: turn in any case, go where there is floor and no one else.
    cell0 = int(state[CELL])
    cell1 = int(state[CHEF + CELL])
    next0 = cell0
    next1 = cell1
    if a0 < STAY:
        state[FACING] = a0
        target = _ahead(cell0, a0, width)
        if spec[SPEC_TILES + target] == FLOOR:
            next0 = target
    if a1 < STAY:
        state[CHEF + FACING] = a1
        target = _ahead(cell1, a1, width)
        if spec[SPEC_TILES + target] == FLOOR:
            next1 = target
    if next0 == next1 or (next0 == cell1 and next1 == cell0):
        next0 = cell0
        next1 = cell1
    if a0 < STAY and next0 == cell0:
        events0 |= 1 << BIT_BLOCKED
    if a1 < STAY and next1 == cell1:
        events1 |= 1 << BIT_BLOCKED
    state[CELL] = next0
    state[CHEF + CELL] = next1

    # 3. Cooking: a full pot cooks by itself; the tick that filled it counts.
    ready = 0
    cook_time = spec[SPEC_COOK_TIME]
    first_pot = SPEC_TILES + width * spec[SPEC_HEIGHT]
    for pot in range(spec[SPEC_POTS]):
        slot = CELLS + spec[first_pot + pot]
        packed = int(state[slot])
        ticks = packed // POT_TICKS
        if (packed // POT_COUNT) % POT_COUNT == INGREDIENTS_PER_SOUP and ticks < cook_time:
            state[slot] = packed + POT_TICKS
            if ticks + 1 == cook_time:
                ready |= 1 << pot

    state[TICK] += 1
    reward = 0
    if events0 & (1 << BIT_PAID):
        reward += int(spec[SPEC_REWARD])
    if events1 & (1 << BIT_PAID):
        reward += int(spec[SPEC_REWARD])
    out[OUT_REWARD] = reward
    out[OUT_EVENTS] = events0
    out[OUT_EVENTS + 1] = events1
    out[OUT_READY] = ready
    return reward


@kernel
def step_batch(
    spec: NDArray[int16], states: NDArray[int16], actions: NDArray[uint8], out: NDArray[int32]
) -> None:
    """Nothing; one tick of B kitchens: `states` int16[B,S], `actions` uint8[B,2], `out` int32[B,4]."""
    for index in range(states.shape[0]):
        step(spec, states[index], actions[index, 0], actions[index, 1], out[index])


@kernel
def run(
    spec: NDArray[int16], state: NDArray[int16], joint_actions: NDArray[uint8],
    states: NDArray[int16], out: NDArray[int32],
) -> None:  # fmt: skip
    """Nothing; plays T ticks on from `state` int16[S].

    `joint_actions` uint8[T,2] in; `states` int16[T+1,S] and `out` int32[T,4] are filled.
    """
    states[0] = state
    for tick in range(joint_actions.shape[0]):
        states[tick + 1] = states[tick]
        step(spec, states[tick + 1], joint_actions[tick, 0], joint_actions[tick, 1], out[tick])
