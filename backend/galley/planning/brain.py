"""What a planning robot works out about a layout before it acts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen.codes import (
    COUNTER,
    DISH_DISPENSER,
    INGREDIENTS_PER_SOUP,
    ONION_DISPENSER,
    POT,
    SERVING,
    TOMATO_DISPENSER,
)
from galley.kitchen.layout import Layout
from galley.planning.distances import Distances, distances
from galley.planning.joint_motion import joint_tables
from galley.planning.kernels.robot_kernel import Brain
from galley.planning.kernels.value_kernel import (
    AT_POT,
    AT_SERVING,
    FETCH_SOUP,
    FILL_POT,
    LEFTS,
    MOST_SWEEPS,
    PUT_DOWN,
    SERVE,
    STANDS,
    TAKE_A_DISH,
    TAKE_INGREDIENT,
    TASKS,
    UNABLE,
    WITH_DISH,
    WITH_INGREDIENT,
    WITH_SOUP,
    WORLDS,
    iterate,
)
from galley.planning.solvable import require_solvable

_STATIONS = {
    TAKE_INGREDIENT: (ONION_DISPENSER, TOMATO_DISPENSER),
    TAKE_A_DISH: (DISH_DISPENSER,),
    FILL_POT: (POT,),
    FETCH_SOUP: (POT,),
    SERVE: (SERVING,),
    PUT_DOWN: (COUNTER,),
}
"""The tiles at which each subtask of the value tables is done."""
_PLACES = {
    AT_POT: (POT,),
    AT_SERVING: (SERVING,),
    WITH_INGREDIENT: (ONION_DISPENSER, TOMATO_DISPENSER),
    WITH_DISH: (DISH_DISPENSER,),
    WITH_SOUP: (POT,),
}
"""Where a chef is at each stand."""

MOST_FLOOR_FOR_ALL_COUNTERS = 40
CENTRAL_COUNTERS = 4
"""In a kitchen with more floor cells, the counters over which a team may pass things."""


def brain(layout: Layout, seat: int, team: bool = False) -> Brain:
    """All that a robot on `seat` needs to know of a layout; its joint motion tables are still empty.

    In a `team` the other chef is not a human who draws its subtasks but plans along.

    Raises:
        GalleyError: the layout cannot be served, is too large, or value iteration reached its limit.
    """
    known = distances(layout)
    require_solvable(known)
    pots = int((known.reachable.any(axis=0) & (layout.tiles.ravel() == POT)).sum())
    robot_takes, human_takes = durations(known, seat), durations(known, 1 - seat)
    needed = [
        (AT_POT, TAKE_INGREDIENT),
        (AT_POT, TAKE_A_DISH),
        (WITH_INGREDIENT, FILL_POT),
        (WITH_DISH, FETCH_SOUP),
        (WITH_SOUP, SERVE),
    ]
    _add_cooking(layout.rules.cook_time_ticks, pots, robot_takes, human_takes)
    passes = any(takes[one] >= UNABLE for takes in (robot_takes, human_takes) for one in needed)
    longest = max(takes[takes < UNABLE].max(initial=1.0) for takes in (robot_takes, human_takes))
    unit = max(1.0, float(longest) / (LEFTS - 1))
    robot_next = np.zeros((STANDS, TASKS, LEFTS, WORLDS), dtype=np.float32)
    human_next = np.zeros((TASKS, LEFTS, STANDS, WORLDS), dtype=np.float32)
    if not passes:
        sweeps = iterate(robot_takes, human_takes, pots, unit, robot_next, human_next, team)
        if sweeps >= MOST_SWEEPS:
            raise GalleyError(
                f"layout {layout.name!r}: the robot's values did not settle in {MOST_SWEEPS} sweeps; "
                "shorten the ways between its stations"
            )
    return Brain(
        spec=layout.spec,
        costs=known.costs,
        reach=known.reachable,
        joint=joint_tables(layout),
        robot_next=robot_next,
        human_next=human_next,
        human_takes=human_takes,
        unit=np.array([unit]),
        pots=np.array([pots, int(passes)]),
        passing=_passing(known, passes),
    )


def _passing(known: Distances, needed: bool) -> NDArray[np.bool_]:
    """bool[H*W]: the counters that both chefs reach; in a large kitchen where nothing has to be passed over
    them only the most central, as each takes tables of joint motion with every station."""
    layout = known.layout
    shared: NDArray[np.bool_] = known.reachable.all(axis=0) & (layout.tiles.ravel() == COUNTER)
    if needed or len(layout.floor) <= MOST_FLOOR_FOR_ALL_COUNTERS:
        return shared
    cells = np.flatnonzero(shared)
    ways = np.where(known.costs[:, cells] < 0, 0, known.costs[:, cells]).sum(axis=0, dtype=np.int64)
    central = np.zeros_like(shared)
    central[cells[np.argsort(ways, kind="stable")[:CENTRAL_COUNTERS]]] = True
    return central


def durations(known: Distances, seat: int) -> NDArray[np.float64]:
    """float64[STANDS, TASKS]: the ticks each subtask takes from each stand, `UNABLE` where it cannot be done.

    A mean over the poses at which the stand's stations are faced, of the way to the nearest station of the
    subtask, and one tick to interact; cooking is left out.
    """
    layout = known.layout
    tiles = layout.tiles.ravel()
    start = 4 * layout.cell(layout.starts[seat])
    costs = known.costs[_own_poses(known, start)]
    found = np.full((STANDS, TASKS), UNABLE)
    for stand, here in _PLACES.items():
        beside = costs[(costs[:, np.isin(tiles, here)] == 0).any(axis=1)]
        for task, there in _STATIONS.items():
            ways = beside[:, np.isin(tiles, there)]
            ways = np.where(ways < 0, np.int16(UNABLE), ways)
            if ways.size and ways.min() < UNABLE:
                found[stand, task] = ways.min(axis=1).mean() + 1
    return found


def _add_cooking(cook_time: int, pots: int, *teams: NDArray[np.float64]) -> None:
    """Lengthen the fetching of a soup by what is likely left of its cooking.

    That is what remains when a dish was taken at once, less the time in which the quicker chef fills the
    other pots meanwhile: who has several pots to serve seldom waits at one.
    """
    filling = min(
        INGREDIENTS_PER_SOUP * float(takes[AT_POT, TAKE_INGREDIENT] + takes[WITH_INGREDIENT, FILL_POT])
        for takes in teams
    )
    for takes in teams:
        if takes[AT_POT, TAKE_A_DISH] < UNABLE and takes[WITH_DISH, FETCH_SOUP] < UNABLE:
            left = cook_time - float(takes[AT_POT, TAKE_A_DISH]) - (pots - 1) * filling
            takes[WITH_DISH, FETCH_SOUP] = max(takes[WITH_DISH, FETCH_SOUP], left)


def _own_poses(known: Distances, start: int) -> NDArray[np.bool_]:
    """bool[P]: the poses from which exactly what the chef at pose `start` can face can be faced."""
    can = known.costs >= 0
    same: NDArray[np.bool_] = (can == can[start]).all(axis=1)
    return same
