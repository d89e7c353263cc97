"""The costs to go of a robot that works beside a human, by value iteration over subtasks; compiled.

The problem left after the details are: where each chef last interacted and with what in hand (a stand), which
subtask the other is at and how long it still takes, how many ingredients are in the pot being filled, how
many soups cook or are ready, how many orders remain. The robot chooses its next subtask whenever it has
done one; the human draws its next one uniformly from those that make sense. A subtask takes the mean of the
shortest ways between the stations.

Source: Fontaine et al. 2021 (RSS), App. B (the tuple S, A, T, C). Ours: subtasks of different length, so that
either chef may be done first; several pots.
"""
# mypy: disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numpy import float32, float64
from numpy.typing import NDArray

from galley.compiled.kernels import lean_kernel
from galley.kitchen.codes import INGREDIENTS_PER_SOUP

# What a chef is at.
IDLE = 0
TAKE_INGREDIENT = 1
TAKE_A_DISH = 2
FILL_POT = 3
FETCH_SOUP = 4
SERVE = 5
PUT_DOWN = 6
TASKS = 7
# Where a chef is between two subtasks, and what it holds.
AT_POT = 0  # empty-handed
AT_SERVING = 1  # empty-handed
WITH_INGREDIENT = 2
WITH_DISH = 3
WITH_SOUP = 4
STANDS = 5

MOST_FULL = 2
"""Soups cooking or ready that are told apart; more count as this many."""
MOST_ORDERS = 6
"""Orders that costs to go look ahead."""
LEFTS = 16
"""Steps of the time that a subtask still takes."""
WORLDS = INGREDIENTS_PER_SOUP * (MOST_FULL + 1) * MOST_ORDERS
UNABLE = 1000.0
"""The duration of what a chef cannot do."""
IDLE_TICKS = 3.0
MOST_SWEEPS = 300
PRECISION = 0.25
"""Value iteration ends when no cost changes by as many ticks."""


@lean_kernel
def world(count: int, full: int, orders: int) -> int:
    """The number of (ingredients in the pot being filled, soups cooking or ready, orders remaining)."""
    return (count * (MOST_FULL + 1) + full) * MOST_ORDERS + orders - 1


@lean_kernel
def done(task: int, at: int, pots: int) -> tuple[int, int]:
    """(stand, world) after a subtask; world -1 when the last order is served."""
    orders = at % MOST_ORDERS + 1
    full = at // MOST_ORDERS % (MOST_FULL + 1)
    count = at // MOST_ORDERS // (MOST_FULL + 1)
    stand = AT_POT
    if task == TAKE_INGREDIENT:
        stand = WITH_INGREDIENT
    elif task == TAKE_A_DISH:
        stand = WITH_DISH
    elif task == FILL_POT:
        if count > 0 or full < pots:
            count += 1
            if count == INGREDIENTS_PER_SOUP:
                count = 0
                full = min(full + 1, MOST_FULL)
        else:
            stand = WITH_INGREDIENT
    elif task == FETCH_SOUP:
        if full > 0:
            full -= 1
            stand = WITH_SOUP
        else:
            stand = WITH_DISH
    elif task == SERVE:
        stand = AT_SERVING
        orders -= 1
        if orders == 0:
            return stand, -1
    return stand, world(count, full, orders)


@lean_kernel
def sensible(stand: int, task: int, at: int, pots: int, other: int, team: bool) -> bool:
    """Whether a subtask makes sense while the other chef is at `other`; a team takes things ahead."""
    full = at // MOST_ORDERS % (MOST_FULL + 1)
    count = at // MOST_ORDERS // (MOST_FULL + 1)
    if stand == WITH_SOUP:
        return task == SERVE
    if stand == WITH_INGREDIENT:
        room = count > 0 or full < pots
        return task == FILL_POT if room else task == PUT_DOWN or (team and task == FILL_POT)
    if stand == WITH_DISH:
        return task == FETCH_SOUP if full > 0 else task == PUT_DOWN or (team and task == FETCH_SOUP)
    if task == TAKE_INGREDIENT:
        return count > 0 or full < pots or team
    return task == TAKE_A_DISH and full + (team and count > 0) > (other == FETCH_SOUP)


@lean_kernel
def _step(ticks: float, unit: float) -> int:
    return min(LEFTS - 1, int(ticks / unit + 0.5))


@lean_kernel
def both_busy(
    robot: int, robot_left: float, human: int, human_left: float, at: int, pots: int, unit: float,
    robot_next: NDArray[float32], human_next: NDArray[float32],
) -> float:  # fmt: skip
    """The cost to go while the robot is at one subtask for so long and the human at another."""
    if robot_left <= human_left:
        stand, then = done(robot, at, pots)
        if then < 0:
            return robot_left
        return robot_left + robot_next[stand, human, _step(human_left - robot_left, unit), then]
    stand, then = done(human, at, pots)
    if then < 0:
        return human_left
    return human_left + human_next[robot, _step(robot_left - human_left, unit), stand, then]


@lean_kernel
def robot_waits(
    stand: int, human: int, human_left: float, at: int, pots: int, unit: float,
    durations: NDArray[float64], robot_next: NDArray[float32], team: bool,
) -> float:  # fmt: skip
    """The cost to go of a robot that waits until the human has done its subtask and begun another."""
    ticks = max(human_left, 1.0)
    human_stand, then = done(human, at, pots)
    if then < 0:
        return ticks
    total = 0.0
    least = np.inf
    ways = 0
    for task in range(1, TASKS):
        if sensible(human_stand, task, then, pots, IDLE, team) and durations[human_stand, task] < UNABLE:
            cost = robot_next[stand, task, _step(durations[human_stand, task], unit), then]
            total += cost
            least = min(least, cost)
            ways += 1
    if ways == 0:
        return ticks + robot_next[stand, IDLE, _step(IDLE_TICKS, unit), then]
    return ticks + (least if team else total / ways)


@lean_kernel
def iterate(
    robot_takes: NDArray[float64], human_takes: NDArray[float64], pots: int, unit: float,
    robot_next: NDArray[float32], human_next: NDArray[float32], team: bool,
) -> int:  # fmt: skip
    """How many sweeps it took (MOST_SWEEPS: the limit was reached); fills both tables of costs to go.

    `robot_takes`, `human_takes` float64[STANDS, TASKS]: durations in ticks, as costs are. `robot_next`
    float32[STANDS, TASKS, LEFTS, WORLDS]: the robot chooses while the human is at a task. `human_next`
    float32[TASKS, LEFTS, STANDS, WORLDS]: the human draws while the robot is at a task; in a `team` it
    chooses the best as well.
    """
    robot_next[:] = 0
    human_next[:] = 0
    sweeps = 0
    for orders in range(1, MOST_ORDERS + 1):  # costs with fewer orders never depend on those with more
        for sweep in range(MOST_SWEEPS):
            change = 0.0
            for rest in range(WORLDS // MOST_ORDERS - 1, -1, -1):
                at = rest * MOST_ORDERS + orders - 1
                for busy in range(TASKS):
                    for left in range(LEFTS):
                        ticks = left * unit
                        for stand in range(STANDS):
                            best = robot_waits(
                                stand, busy, ticks, at, pots, unit, human_takes, robot_next, team
                            )
                            total = 0.0
                            least = np.inf
                            ways = 0
                            for task in range(1, TASKS):
                                if not sensible(stand, task, at, pots, busy, team):
                                    continue
                                if robot_takes[stand, task] < UNABLE:
                                    cost = both_busy(
                                        task, robot_takes[stand, task], busy, ticks, at, pots, unit,
                                        robot_next, human_next,
                                    )  # fmt: skip
                                    best = min(best, cost)
                                if human_takes[stand, task] < UNABLE:
                                    cost = both_busy(
                                        busy, ticks, task, human_takes[stand, task], at, pots, unit,
                                        robot_next, human_next,
                                    )  # fmt: skip
                                    total += cost
                                    least = min(least, cost)
                                    ways += 1
                            if ways == 0:
                                total = both_busy(
                                    busy, ticks, IDLE, IDLE_TICKS, at, pots, unit, robot_next, human_next
                                )
                                least = total
                                ways = 1
                            change = max(change, abs(best - robot_next[stand, busy, left, at]))
                            robot_next[stand, busy, left, at] = best
                            mean = least if team else total / ways
                            change = max(change, abs(mean - human_next[busy, left, stand, at]))
                            human_next[busy, left, stand, at] = mean
            sweeps = max(sweeps, sweep + 1)
            if change < PRECISION:
                break
    return sweeps
