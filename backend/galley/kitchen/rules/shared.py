"""What any rule set shares: start and end of an episode, what lies ahead, moving, carrying; compiled."""

from __future__ import annotations

from numpy import int16
from numpy.typing import NDArray

from galley.compiled.kernels import lean_kernel
from galley.kitchen.codes import (
    BIT_PICK_UP,
    BIT_PUT_DOWN,
    BIT_TAKE,
    CELL,
    CHEF,
    DISH,
    EAST,
    FACING,
    FLOOR,
    NORTH,
    NOTHING,
    ONION,
    ONION_DISPENSER,
    ORDERS_DELIVERED,
    SOUTH,
    SPEC_HORIZON,
    SPEC_ORDERS,
    SPEC_STARTS,
    SPEC_TILES,
    SPEC_WIDTH,
    STAY,
    TICK,
    TOMATO,
    TOMATO_DISPENSER,
)


@lean_kernel
def reset(spec: NDArray[int16], state: NDArray[int16]) -> None:
    """Set `state` int16[S] to the start: empty hands, facing north, nothing lying or cooking."""
    state[:] = 0
    state[CELL] = spec[SPEC_STARTS]
    state[CHEF + CELL] = spec[SPEC_STARTS + 1]


@lean_kernel
def all_delivered(spec: NDArray[int16], state: NDArray[int16]) -> bool:
    """Whether there is an order list and every order of it is delivered."""
    orders = spec[SPEC_ORDERS]
    return bool(orders > 0 and state[ORDERS_DELIVERED] >= orders)


@lean_kernel
def finished(spec: NDArray[int16], state: NDArray[int16]) -> bool:
    """Whether the episode is over: at the horizon, or when every order of the list is delivered."""
    if state[TICK] >= spec[SPEC_HORIZON]:
        return True
    return all_delivered(spec, state)


@lean_kernel
def ahead(cell: int, facing: int, width: int) -> int:
    """The cell index one step from `cell` towards `facing`."""
    if facing == NORTH:
        return cell - width
    if facing == SOUTH:
        return cell + width
    if facing == EAST:
        return cell + 1
    return cell - 1


@lean_kernel
def use_counter(state: NDArray[int16], hand: int, slot: int) -> int:
    """The event mask of a chef who interacts with the counter at `slot` of the state."""
    held = int(state[hand])
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


@lean_kernel
def use_dispenser(state: NDArray[int16], hand: int, tile: int) -> int:
    """The event mask of a chef who interacts with a dispenser."""
    if state[hand] != NOTHING:
        return 0
    if tile == ONION_DISPENSER:
        thing = ONION
    elif tile == TOMATO_DISPENSER:
        thing = TOMATO
    else:
        thing = DISH
    state[hand] = thing
    return 1 << (BIT_TAKE + thing - ONION)


@lean_kernel
def move(spec: NDArray[int16], state: NDArray[int16], a0: int, a1: int) -> tuple[bool, bool]:
    """Whether seat 0's and seat 1's move was blocked. Both turn in any case, and go where there is floor and
    no one else."""
    width = int(spec[SPEC_WIDTH])
    cell0 = int(state[CELL])
    cell1 = int(state[CHEF + CELL])
    next0 = cell0
    next1 = cell1
    if a0 < STAY:
        state[FACING] = a0
        target = ahead(cell0, a0, width)
        if spec[SPEC_TILES + target] == FLOOR:
            next0 = target
    if a1 < STAY:
        state[CHEF + FACING] = a1
        target = ahead(cell1, a1, width)
        if spec[SPEC_TILES + target] == FLOOR:
            next1 = target
    if next0 == next1 or (next0 == cell1 and next1 == cell0):
        next0 = cell0
        next1 = cell1
    state[CELL] = next0
    state[CHEF + CELL] = next1
    return a0 < STAY and next0 == cell0, a1 < STAY and next1 == cell1
