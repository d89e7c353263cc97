"""The subtasks a chef may take up, compiled. `subtasks.py` shows them as a table.

Source: Fontaine et al. 2021 (RSS), App. B and Fig. 9. Ours: passing over counters that both chefs reach,
order lists, tomatoes.
"""

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
    HELD,
    NOTHING,
    ONION,
    ONION_DISPENSER,
    POT,
    SERVING,
    SPEC_ORDERS,
    SPEC_TILES,
    TOMATO,
    TOMATO_DISPENSER,
)
from galley.kitchen.pots import is_soup, soup_of
from galley.planning.kernels.needs_kernel import (
    drop_at,
    free_counter,
    must_pass,
    need_of,
    open_order,
    pot_room,
    reaches_tile,
    wanted_kind,
)

WAIT = 0
TAKE_ONION = 1
TAKE_TOMATO = 2
TAKE_DISH = 3
TAKE_SOUP = 4
FILL = 5
FETCH = 6
DELIVER = 7
DROP = 8
KINDS = 9
NEAREST = 3
"""Of the tiles where a subtask can be done, those considered."""


@lean_kernel
def add_tile(out: NDArray[int16], kind: int, cell: int, costs: NDArray[int16]) -> None:
    """Make `cell` one of the nearest tiles of a subtask if it is."""
    if cell < 0 or costs[cell] < 0:
        return
    row = out[kind]
    count = row[0]
    at = count
    while at > 0 and costs[row[at]] > costs[cell]:
        at -= 1
    if at >= NEAREST:
        return
    for later in range(min(count, NEAREST - 1), at, -1):
        row[later + 1] = row[later]
    row[at + 1] = cell
    row[0] = min(count + 1, NEAREST)


@lean_kernel
def add_sources(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    thing: int, unshared: bool, kind: int, out: NDArray[int16],
) -> None:  # fmt: skip
    """Add where a thing is to be had; with `unshared`, not from counters the other chef reaches."""
    dispenser = -1
    if thing == ONION:
        dispenser = ONION_DISPENSER
    elif thing == TOMATO:
        dispenser = TOMATO_DISPENSER
    elif thing == DISH:
        dispenser = DISH_DISPENSER
    for cell in range(reach.shape[1]):
        if costs[cell] < 0:
            continue
        tile = spec[SPEC_TILES + cell]
        lies = tile == COUNTER and state[CELLS + cell] == thing and not (unshared and reach[1 - seat, cell])
        if lies or tile == dispenser:
            add_tile(out, kind, cell, costs)


@lean_kernel
def _with_empty_hands(
    spec: NDArray[int16], state: NDArray[int16], reach: NDArray[bool_], costs: NDArray[int16], seat: int,
    wanted: int, out: NDArray[int16],
) -> None:  # fmt: skip
    other = 1 - seat
    serves = reaches_tile(spec, reach, seat, SERVING)
    if serves or reaches_tile(spec, reach, other, SERVING):
        for kind in (ONION, TOMATO):
            if spec[SPEC_ORDERS] == 0 or open_order(spec, state, 0) == kind:
                add_sources(spec, state, reach, costs, seat, soup_of(kind), not serves, TAKE_SOUP, out)
    room = free_counter(spec, state, reach, costs, seat, True) >= 0
    on_its_way = state[CHEF * other + HELD] == DISH
    if need_of(spec, state, reach, seat, DISH, wanted, -1) > on_its_way:
        add_sources(spec, state, reach, costs, seat, DISH, False, TAKE_DISH, out)
    elif room and must_pass(spec, state, reach, seat, DISH, wanted):
        add_sources(spec, state, reach, costs, seat, DISH, True, TAKE_DISH, out)
    for kind in (ONION, TOMATO):
        task = TAKE_ONION if kind == ONION else TAKE_TOMATO
        if need_of(spec, state, reach, seat, kind, wanted, -1) > 0:
            add_sources(spec, state, reach, costs, seat, kind, False, task, out)
        elif room and must_pass(spec, state, reach, seat, kind, wanted):
            add_sources(spec, state, reach, costs, seat, kind, True, task, out)


@lean_kernel
def subtasks(
    spec: NDArray[int16], all_costs: NDArray[int16], reach: NDArray[bool_], state: NDArray[int16], seat: int,
    out: NDArray[int16],
) -> None:  # fmt: skip
    """Fill `out` int16[KINDS, 4]: for each kind how many tiles, then up to 3 cells, nearest first.

    A kind without tiles is not feasible; to wait always is and has none.
    """
    out[:] = 0
    chef = CHEF * seat
    costs = all_costs[state[chef + CELL] * 4 + state[chef + FACING]]
    held = int(state[chef + HELD])
    wanted = wanted_kind(spec, state, reach)
    if held == NOTHING:
        _with_empty_hands(spec, state, reach, costs, seat, wanted, out)
        return
    kind = FILL
    if held == DISH:
        kind = FETCH
    elif held > DISH:
        kind = DELIVER
    for cell in range(costs.size):
        tile = spec[SPEC_TILES + cell]
        packed = int(state[CELLS + cell])
        if kind == DELIVER:
            fits = tile == SERVING
        elif kind == FETCH:
            fits = tile == POT and is_soup(packed)
        else:
            fits = tile == POT and pot_room(packed, wanted, held, spec[SPEC_ORDERS] == 0) > 0
        if fits:
            add_tile(out, kind, cell, costs)
    if kind == DELIVER and spec[SPEC_ORDERS] > 0 and soup_of(open_order(spec, state, 0)) != held:
        for later in range(1, spec[SPEC_ORDERS]):
            if soup_of(open_order(spec, state, later)) == held:  # its turn comes
                out[DELIVER, 0] = 0
    if out[kind, 0] > 0:
        return
    if kind == DELIVER:
        passes = reaches_tile(spec, reach, 1 - seat, SERVING) and not reaches_tile(spec, reach, seat, SERVING)
    else:
        passes = must_pass(spec, state, reach, seat, held, wanted)
    if passes:
        add_tile(out, DROP, free_counter(spec, state, reach, costs, seat, True), costs)
    else:
        add_tile(out, DROP, drop_at(spec, state, reach, costs, seat), costs)


@lean_kernel
def kind_at(spec: NDArray[int16], held: int, cell: int) -> int:
    """The subtask of a chef with this in hand who means to interact with the tile at `cell` (-1: none)."""
    if cell < 0:
        return WAIT
    tile = spec[SPEC_TILES + cell]
    if held == NOTHING:
        if tile == ONION_DISPENSER:
            return TAKE_ONION
        if tile == TOMATO_DISPENSER:
            return TAKE_TOMATO
        if tile == DISH_DISPENSER:
            return TAKE_DISH
        return TAKE_SOUP  # a counter: what lies there decides, see `kind_of`
    if tile == COUNTER:
        return DROP
    if tile == SERVING:
        return DELIVER
    return FETCH if held == DISH else FILL


@lean_kernel
def kind_of(spec: NDArray[int16], state: NDArray[int16], seat: int, cell: int) -> int:
    """The subtask that a chef is at who means to interact with the tile at `cell` (-1: none)."""
    held = state[CHEF * seat + HELD]
    if cell >= 0 and held == NOTHING and spec[SPEC_TILES + cell] == COUNTER:
        lying = state[CELLS + cell]
        if lying == ONION:
            return TAKE_ONION
        if lying == TOMATO:
            return TAKE_TOMATO
        return TAKE_DISH if lying == DISH else TAKE_SOUP
    return kind_at(spec, held, cell)
