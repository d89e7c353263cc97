"""The compiled encodings of a kitchen for policies.

What the numbers mean is told in `observations.py` and `docs/rules.md`.
"""

from __future__ import annotations

from numpy import float32, int16, int64, uint8
from numpy.typing import NDArray

from galley.compiled.kernels import kernel
from galley.kitchen.codes import (
    CELL,
    CELLS,
    CHEF,
    DISH,
    FACING,
    FLOOR,
    HELD,
    NOTHING,
    ONION,
    ONION_SOUP,
    POT,
    SPEC_HEIGHT,
    SPEC_HORIZON,
    SPEC_TILES,
    SPEC_WIDTH,
    STAY,
    TICK,
)
from galley.kitchen.pots import amount_in, is_soup, onions_in, recipe_of_thing, ticks_in, ticks_left
from galley.kitchen.rules.shared import ahead

LARGEST = 255  # an observation's number is a byte
URGENT_TICKS = 40
NO_WAY = -1  # in a table of action costs

# Channels of `grid`.
G_OWN, G_OTHER, G_OWN_FACING, G_OTHER_FACING = 0, 1, 2, 6
G_IN_POT, G_IN_SOUP, G_REMAINING, G_DONE = 16, 18, 20, 21
G_DISHES, G_INGREDIENTS, G_URGENT = 22, 23, 25

# Channels of `overcooked-2019-grid`.
C_IN_POT, C_COOKED, C_SOUPS, C_DISHES, C_ONIONS = 15, 16, 17, 18, 19
C_CHANNELS = 20

# Numbers of `overcooked-2019-features` for one player, and the kinds of target in its tables.
F_HELD, F_ONION, F_EMPTY, F_COOKING, F_READY, F_DISH, F_SERVING, F_WALLS = 4, 7, 9, 15, 17, 19, 23, 25
F_PLAYER = 29
F_ONIONS, F_POTS, F_DISHES, F_SERVINGS = 0, 1, 2, 3
ANY_POT, EMPTY_POT, COOKING_POT, READY_POT = -1, 0, 1, 2


@kernel
def _grid_thing(thing: int, cell: int, cells: int, out: NDArray[uint8]) -> None:
    """Mark a thing that lies or is held at `cell` in `out` uint8[26*H*W]."""
    if thing >= ONION_SOUP:
        recipe = recipe_of_thing(thing)
        onions = onions_in(recipe)
        out[G_IN_SOUP * cells + cell] += onions
        out[(G_IN_SOUP + 1) * cells + cell] += amount_in(recipe) - onions
        out[G_DONE * cells + cell] += 1
    elif thing == DISH:
        out[G_DISHES * cells + cell] += 1
    else:
        out[(G_INGREDIENTS + thing - ONION) * cells + cell] += 1


@kernel
def _grid(
    spec: NDArray[int16], static: NDArray[uint8], state: NDArray[int16], seat: int, out: NDArray[uint8]
) -> None:
    """Write one seat's `grid` into `out` uint8[26*H*W]; `static` holds the map's channels."""
    cells = int(spec[SPEC_WIDTH]) * int(spec[SPEC_HEIGHT])
    for index in range(static.size):
        out[index] = static[index]
    own = CHEF * seat
    other = CHEF - own
    out[G_OWN * cells + state[own + CELL]] = 1
    out[G_OTHER * cells + state[other + CELL]] = 1
    out[(G_OWN_FACING + int(state[own + FACING])) * cells + state[own + CELL]] = 1
    out[(G_OTHER_FACING + int(state[other + FACING])) * cells + state[other + CELL]] = 1
    for cell in range(cells):
        thing = int(state[CELLS + cell])
        if thing == NOTHING:
            continue
        if spec[SPEC_TILES + cell] != POT:
            _grid_thing(thing, cell, cells, out)
            continue
        onions = onions_in(thing)
        tomatoes = amount_in(thing) - onions
        if not is_soup(thing):
            out[G_IN_POT * cells + cell] = onions
            out[(G_IN_POT + 1) * cells + cell] = tomatoes
            continue
        remaining = ticks_left(spec, thing)
        out[G_IN_SOUP * cells + cell] = onions
        out[(G_IN_SOUP + 1) * cells + cell] = tomatoes
        out[G_REMAINING * cells + cell] = min(remaining, LARGEST)
        if remaining <= 0:
            out[G_DONE * cells + cell] = 1
    for chef in (0, CHEF):
        held = int(state[chef + HELD])
        if held != NOTHING:
            _grid_thing(held, int(state[chef + CELL]), cells, out)
    if spec[SPEC_HORIZON] - state[TICK] < URGENT_TICKS:
        out[G_URGENT * cells : (G_URGENT + 1) * cells] = 1


@kernel
def _grid_2019(
    spec: NDArray[int16], static: NDArray[uint8], state: NDArray[int16], seat: int, out: NDArray[uint8]
) -> None:
    """Write one seat's `overcooked-2019-grid` into `out` uint8[W*H*20]."""
    width = int(spec[SPEC_WIDTH])
    height = int(spec[SPEC_HEIGHT])
    for index in range(static.size):
        out[index] = static[index]
    own = CHEF * seat
    other = CHEF - own
    held_soup = False
    held_dish = False
    held_onion = False
    for player, place, facings in ((own, 0, 2), (other, 1, 6)):
        cell = int(state[player + CELL])
        at = ((cell % width) * height + cell // width) * C_CHANNELS
        out[at + place] = 1
        out[at + facings + state[player + FACING]] = 1
        held = state[player + HELD]
        if held == ONION_SOUP:
            held_soup = True
            out[at + C_SOUPS] = 1
        elif held == DISH:
            held_dish = True
            out[at + C_DISHES] = 1
        elif held == ONION:
            held_onion = True
            out[at + C_ONIONS] = 1
    for cell in range(width * height):
        thing = int(state[CELLS + cell])
        if thing == NOTHING:
            continue
        at = ((cell % width) * height + cell // width) * C_CHANNELS
        if spec[SPEC_TILES + cell] == POT:
            if not held_soup:
                out[at + C_IN_POT] = amount_in(thing)
                out[at + C_COOKED] = min(ticks_in(thing), LARGEST)
        elif thing == ONION_SOUP and not held_soup:
            out[at + C_SOUPS] = 1
        elif thing == DISH and not held_dish:
            out[at + C_DISHES] = 1
        elif thing == ONION and not held_onion:
            out[at + C_ONIONS] = 1


@kernel
def _closest(
    spec: NDArray[int16], costs: NDArray[int16], targets: NDArray[int16], kind: int, wanted: int,
    state: NDArray[int16], chef: int, out: NDArray[float32], at: int,
) -> None:  # fmt: skip
    """Write (dx, dy) to the closest target of a kind (and for pots, condition) at `out[at]`."""
    cell = int(state[chef + CELL])
    pose = cell * STAY + state[chef + FACING]
    best = NO_WAY
    found = NO_WAY
    for index in range(targets.shape[0]):
        if targets[index, 0] != kind or costs[pose, index] == NO_WAY:
            continue
        target = int(targets[index, 1])
        if wanted != ANY_POT:
            pot = int(state[CELLS + target])
            if wanted == EMPTY_POT:
                fits = pot == 0
            else:
                fits = is_soup(pot) and (ticks_left(spec, pot) <= 0) == (wanted == READY_POT)
            if not fits:
                continue
        if found == NO_WAY or costs[pose, index] < best:
            best = costs[pose, index]
            found = target
    if found != NO_WAY:
        width = spec[SPEC_WIDTH]
        out[at] = found % width - cell % width
        out[at + 1] = found // width - cell // width


@kernel
def _player_2019(
    spec: NDArray[int16], costs: NDArray[int16], targets: NDArray[int16],
    state: NDArray[int16], chef: int, out: NDArray[float32],
) -> None:  # fmt: skip
    """Write the 29 numbers of the player at `chef` of the state into `out` float32[29] of zeros."""
    held = state[chef + HELD]
    out[state[chef + FACING]] = 1
    if held == ONION:
        out[F_HELD] = 1
    elif held == ONION_SOUP:
        out[F_HELD + 1] = 1
    elif held == DISH:
        out[F_HELD + 2] = 1
    if held != ONION:
        _closest(spec, costs, targets, F_ONIONS, ANY_POT, state, chef, out, F_ONION)
    _closest(spec, costs, targets, F_POTS, EMPTY_POT, state, chef, out, F_EMPTY)
    _closest(spec, costs, targets, F_POTS, COOKING_POT, state, chef, out, F_COOKING)
    _closest(spec, costs, targets, F_POTS, READY_POT, state, chef, out, F_READY)
    if held != DISH:
        _closest(spec, costs, targets, F_DISHES, ANY_POT, state, chef, out, F_DISH)
    _closest(spec, costs, targets, F_SERVINGS, ANY_POT, state, chef, out, F_SERVING)
    cell = int(state[chef + CELL])
    width = int(spec[SPEC_WIDTH])
    for facing in range(STAY):
        if spec[SPEC_TILES + ahead(cell, facing, width)] != FLOOR:
            out[F_WALLS + facing] = 1


@kernel
def _features_2019(
    spec: NDArray[int16], costs: NDArray[int16], targets: NDArray[int16],
    state: NDArray[int16], seat: int, out: NDArray[float32],
) -> None:  # fmt: skip
    """Write one seat's `overcooked-2019-features` into `out` float32[62]."""
    out[:] = 0
    own = CHEF * seat
    other = CHEF - own
    width = spec[SPEC_WIDTH]
    _player_2019(spec, costs, targets, state, own, out[:F_PLAYER])
    _player_2019(spec, costs, targets, state, other, out[F_PLAYER : 2 * F_PLAYER])
    out[58] = state[other + CELL] % width - state[own + CELL] % width
    out[59] = state[other + CELL] // width - state[own + CELL] // width
    out[60] = state[CELL] % width
    out[61] = state[CELL] // width


@kernel
def grid(
    spec: NDArray[int16], static: NDArray[uint8], states: NDArray[int16], seats: NDArray[int64],
    out: NDArray[uint8],
) -> None:  # fmt: skip
    """From `states` int16[B,S], `seats` int64[B or 1, K] to `out` uint8[B,K,26*H*W]."""
    for index in range(states.shape[0]):
        row = index if seats.shape[0] > 1 else 0
        for slot in range(seats.shape[1]):
            _grid(spec, static, states[index], seats[row, slot], out[index, slot])


@kernel
def grid_2019(
    spec: NDArray[int16], static: NDArray[uint8], states: NDArray[int16], seats: NDArray[int64],
    out: NDArray[uint8],
) -> None:  # fmt: skip
    """From `states` int16[B,S], `seats` int64[B or 1, K] to `out` uint8[B,K,W*H*20]."""
    for index in range(states.shape[0]):
        row = index if seats.shape[0] > 1 else 0
        for slot in range(seats.shape[1]):
            _grid_2019(spec, static, states[index], seats[row, slot], out[index, slot])


@kernel
def features_2019(
    spec: NDArray[int16], costs: NDArray[int16], targets: NDArray[int16], states: NDArray[int16],
    seats: NDArray[int64], out: NDArray[float32],
) -> None:  # fmt: skip
    """From `costs` int16[H*W*4,T], `targets` int16[T,2] (kind, cell) to `out` float32[B,K,62]."""
    for index in range(states.shape[0]):
        row = index if seats.shape[0] > 1 else 0
        for slot in range(seats.shape[1]):
            _features_2019(spec, costs, targets, states[index], seats[row, slot], out[index, slot])
