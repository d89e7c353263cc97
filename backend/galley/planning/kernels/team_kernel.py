"""The search for a plan that both chefs follow, compiled: A* over pairs of subtasks within a beam.

Source: Fontaine et al. 2021 (RSS), Sec. IV "Centralized Planning", after Carroll et al. 2019. Ours: costs
to go by value iteration as the heuristic, a beam per tick, plans in which one chef has the right of way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy import float32, float64, int16, int32, int64, uint8, uint64
from numpy.typing import NDArray

from galley.compiled.kernels import kernel, lean_kernel
from galley.kitchen.codes import (
    BIT_BLOCKED,
    DELIVERIES,
    INTERACT,
    OUT_EVENTS,
    OUT_SIZE,
    STAY,
    TICK,
)
from galley.kitchen.rules.shared import finished
from galley.kitchen.rules.tick import step
from galley.planning.kernels.joint_kernel import FAR, FREE, MOST_POSES, joint_cost, known_step
from galley.planning.kernels.robot_kernel import Brain, pose_of, way_alone
from galley.planning.kernels.subtask_kernel import (
    KINDS,
    WAIT,
)
from galley.planning.kernels.team_estimate_kernel import must_wait, pair_to_go, to_go

LEG_TICKS = 96
"""The most ticks from one decision to the next interaction."""
PROBES = 64
"""Places looked at for a state met before; beyond them it counts as new."""
LATER_TICKS = 10
"""How much later a plan may end than the first one found if the kitchen is then better prepared."""

FILL_WORK = 8
"""Nodes that take as long as to fill a table of joint motion."""

# The progress of a search, int64 [PROGRESS].
ORDERS = 0
BEYOND = 1
PAIRS = 2
THOROUGH = 3
AT_TICK = 4
AT_PLACE = 5
BEST_END = 6
FIRST_END = 7
BEST_NODE = 8
NODES = 9
MOST_NODES = 10
PROGRESS = 11


class Search(NamedTuple):
    """Space for a search of T ticks with a beam of W nodes a tick; a node's number is tick * W + place."""

    states: NDArray[int16]  # [T * W, S]
    parents: NDArray[int32]  # [T * W]
    legs: NDArray[uint8]  # [T * W, LEG_TICKS, 2], the actions from the parent
    lengths: NDArray[int16]  # [T * W]
    totals: NDArray[float32]  # [T * W], cost so far + cost to go
    counts: NDArray[int32]  # [T], nodes in each tick
    keys: NDArray[uint64]  # [K], states met
    times: NDArray[int16]  # [K], when first
    progress: NDArray[int64]  # [PROGRESS], what is asked and how far the search is
    least: NDArray[float64]  # [1], the cost to go of the most promising node


@lean_kernel
def walk(
    brain: Brain, state: NDArray[int16], cell0: int, cell1: int, wait0: bool, wait1: bool, end0: int,
    end1: int, first: int, leg: NDArray[uint8], out: NDArray[int32],
) -> int:  # fmt: skip
    """How many ticks until a chef has interacted at its tile, 0 if none does; `state` and `leg` are filled.

    A chef ends in the pose `end0` or `end1` (4 * floor + facing), -1: in any that faces its tile.
    `first` 2: both tiles are reached soonest; 0 or 1: that chef's is, the other comes as near as it can.
    """
    goal0 = FREE if wait0 else 1 + cell0
    goal1 = FREE if wait1 else 1 + cell1
    cells = brain.joint.floor_of.size
    if end0 >= 0:
        goal0 = 1 + cells + end0
    if end1 >= 0:
        goal1 = 1 + cells + end1
    useful = ~(1 << BIT_BLOCKED)
    for tick in range(LEG_TICKS):
        at0 = not wait0 and way_alone(brain, state, 0, cell0) == 0 and end0 in (-1, pose_of(brain, state, 0))
        at1 = not wait1 and way_alone(brain, state, 1, cell1) == 0 and end1 in (-1, pose_of(brain, state, 1))
        does0 = at0 and not must_wait(brain, state, 0, cell0)
        does1 = at1 and not must_wait(brain, state, 1, cell1)
        pose0, pose1 = pose_of(brain, state, 0), pose_of(brain, state, 1)
        way = first
        blocked = joint_cost(brain.joint, goal0, goal1, pose0, pose1) >= FAR
        if (way == 0 and (wait0 or at0)) or (way == 1 and (wait1 or at1)):
            way = 2
        if way == 2 and blocked:
            way = 0 if at0 or not at1 else 1
        code = known_step(brain.joint, brain.costs, goal0, goal1, way, pose0, pose1)
        act0, act1 = code // 8, code % 8
        if does0:
            act0 = INTERACT
        elif at0 and blocked:
            act0 = STAY
        if does1:
            act1 = INTERACT
        elif at1 and blocked:
            act1 = STAY
        if act0 == STAY and act1 == STAY and not (at0 or at1):
            return 0
        leg[tick, 0] = act0
        leg[tick, 1] = act1
        step(brain.spec, state, act0, act1, out)
        if (out[OUT_EVENTS] | out[OUT_EVENTS + 1]) & useful:
            return tick + 1
        if does0 or does1:
            return 0
    return 0


@lean_kernel
def _key(state: NDArray[int16]) -> uint64:
    """A hash of everything in a state but the tick."""
    word = uint64(1469598103934665603)
    for index in range(state.size):
        if index != TICK:
            word = (word ^ uint64(state[index] + 7)) * uint64(1099511628211)
            word ^= word >> uint64(29)
    return word | uint64(1)


@lean_kernel
def _met_before(search: Search, key: uint64, tick: int) -> bool:
    """Whether a state was met no later than at `tick`; notes it otherwise."""
    size = search.keys.size
    at = np.int64(key % uint64(size))
    for _ in range(PROBES):
        if search.keys[at] == key:
            if search.times[at] <= tick:
                return True
            search.times[at] = tick
            return False
        if search.keys[at] == 0:
            search.keys[at] = key
            search.times[at] = tick
            return False
        at = (at + 1) % size
    return False


@lean_kernel
def _place(search: Search, tick: int, total: float) -> int:
    """The number of the node that a new one of this estimate takes at a tick, -1 if none is worse."""
    width = search.parents.size // search.counts.size
    if search.counts[tick] < width:
        search.counts[tick] += 1
        return int(tick * width + search.counts[tick] - 1)
    worst = tick * width
    for node in range(tick * width + 1, (tick + 1) * width):
        if search.totals[node] > search.totals[worst]:
            worst = node
    return -1 if search.totals[worst] <= total else int(worst)


@kernel
def begin_search(
    search: Search, start: NDArray[int16], orders: int, beyond: int, pairs: int, thorough: bool,
    most_nodes: int,
) -> None:  # fmt: skip
    """Make ready for a plan for `orders` more soups from `start`.

    With `beyond` more orders to follow the plan is the one after which those are likely to be served soonest.
    Of each node the `pairs` most promising pairs of subtasks are tried, in three ways each; the search ends
    at the latest after `most_nodes`.
    """
    search.counts[:] = 0
    search.keys[:] = 0
    search.counts[0] = 1
    search.states[0] = start
    search.parents[0] = -1
    search.lengths[0] = 0
    search.totals[0] = 0
    search.least[0] = np.inf
    search.progress[:] = 0
    search.progress[BEST_END] = -1
    search.progress[ORDERS] = orders
    search.progress[BEYOND] = beyond
    search.progress[PAIRS] = pairs
    search.progress[THOROUGH] = thorough
    search.progress[MOST_NODES] = most_nodes


@kernel
def search_on(brain: Brain, search: Search, work: int) -> bool:
    """Whether the search is done, after `work` more nodes; a table of joint motion counts as `FILL_WORK`.

    What is found does not depend on how the work is divided: `BEST_END` in its progress is the last node of
    the best plan, or -1 if ticks or nodes ran out before; then `BEST_NODE` is the one of the best estimate.
    """
    progress = search.progress
    ticks = search.counts.size
    width = search.parents.size // ticks
    state = np.empty(search.states.shape[1], dtype=np.int16)
    leg = np.zeros((LEG_TICKS, 2), dtype=np.uint8)
    out = np.zeros(OUT_SIZE, dtype=np.int32)
    options = np.zeros((2, KINDS, 4), dtype=np.int16)
    ahead = np.zeros((2, KINDS, 4), dtype=np.int16)
    summed = np.zeros(brain.reach.shape[1], dtype=np.int16)
    most = (KINDS * 3 + 1) ** 2
    rated = np.empty(most, dtype=np.float64)
    which = np.empty((most, 5), dtype=np.int64)
    served = search.states[0, DELIVERIES]
    done = 0
    while progress[AT_TICK] < ticks and progress[NODES] < progress[MOST_NODES]:
        tick = progress[AT_TICK]
        late = progress[BEYOND] == 0 or tick > progress[FIRST_END] + LATER_TICKS
        if progress[BEST_END] >= 0 and late:
            return True
        if progress[AT_PLACE] >= search.counts[tick]:
            progress[AT_TICK] += 1
            progress[AT_PLACE] = 0
            continue
        if done >= work:
            return False
        node = tick * width + progress[AT_PLACE]
        progress[AT_PLACE] += 1
        now = search.states[node]
        left = progress[ORDERS] - (now[DELIVERIES] - served)
        if left <= 0 or finished(brain.spec, now):
            if progress[BEST_END] < 0:
                progress[FIRST_END] = tick
                progress[BEST_END] = node
            elif search.totals[node] < search.totals[progress[BEST_END]]:
                progress[BEST_END] = node
            continue
        if tick > 0 and search.totals[node] - tick < search.least[0]:
            search.least[0] = search.totals[node] - tick
            progress[BEST_NODE] = node
        filled = brain.joint.used[0]
        to_go(brain, now, left, progress[BEYOND], progress[THOROUGH] != 0, options, summed)
        found = _rate_pairs(brain, now, left + progress[BEYOND], options, rated, which, summed, ahead)
        order = np.argsort(rated[:found])
        for index in range(min(progress[PAIRS], found)):
            _expand(brain, search, node, which[order[index]], state, leg, out, ahead, summed)
        progress[NODES] += 1
        done += 1
        if brain.joint.used[0] != filled:
            done += FILL_WORK * max(1, brain.joint.used[0] - filled)
    return True


@lean_kernel
def _expand(
    brain: Brain, search: Search, node: int, pick: NDArray[int64], state: NDArray[int16],
    leg: NDArray[uint8], out: NDArray[int32], ahead: NDArray[int16], summed: NDArray[int16],
) -> None:  # fmt: skip
    """Add the nodes to which a pair of subtasks, as in `_rate_pairs`, leads from a node."""
    ticks = search.counts.size
    tick = node // (search.parents.size // ticks)
    thorough = search.progress[THOROUGH] != 0
    wait0 = pick[0] == WAIT
    wait1 = pick[2] == WAIT
    most0 = MOST_POSES if thorough and not wait0 else 0
    most1 = MOST_POSES if thorough and not wait1 else 0
    for which0 in range(-1, most0):
        end0 = -1 if which0 < 0 else brain.joint.ends[1 + pick[1], which0]
        if which0 >= 0 and end0 < 0:
            break
        for which1 in range(-1, most1):
            end1 = -1 if which1 < 0 else brain.joint.ends[1 + pick[3], which1]
            if which1 >= 0 and end1 < 0:
                break
            for first in range(2, -1, -1):
                # The right of way matters only where the chefs are in each other's way.
                if first < 2 and (wait0 or wait1 or (pick[4] == 0 and not thorough)):
                    continue
                for index in range(state.size):
                    state[index] = search.states[node, index]
                length = walk(brain, state, pick[1], pick[3], wait0, wait1, end0, end1, first, leg, out)
                then = tick + length
                if length == 0 or then >= ticks or _met_before(search, _key(state), then):
                    continue
                served = state[DELIVERIES] - search.states[0, DELIVERIES]
                still = max(0, search.progress[ORDERS] - served)
                total = float(then)
                if still + search.progress[BEYOND] > 0:
                    total += to_go(brain, state, still, search.progress[BEYOND], thorough, ahead, summed)
                new = _place(search, then, total)
                if new >= 0:
                    for index in range(state.size):
                        search.states[new, index] = state[index]
                    for index in range(length):
                        search.legs[new, index, 0] = leg[index, 0]
                        search.legs[new, index, 1] = leg[index, 1]
                    search.parents[new] = node
                    search.lengths[new] = length
                    search.totals[new] = total


@lean_kernel
def _rate_pairs(
    brain: Brain, state: NDArray[int16], orders: int, options: NDArray[int16], rated: NDArray[float64],
    which: NDArray[int64], summed: NDArray[int16], ahead: NDArray[int16],
) -> int:  # fmt: skip
    """How many pairs of subtasks there are; fills their estimates and (kind, cell, kind, cell, delay)."""
    count = 0
    pose0, pose1 = pose_of(brain, state, 0), pose_of(brain, state, 1)
    for kind0 in range(KINDS):
        for place0 in range(max(1, options[0, kind0, 0])):
            if kind0 != WAIT and options[0, kind0, 0] == 0:
                continue
            cell0 = options[0, kind0, 1 + place0] if kind0 != WAIT else 0
            for kind1 in range(KINDS):
                for place1 in range(max(1, options[1, kind1, 0])):
                    if (kind1 != WAIT and options[1, kind1, 0] == 0) or (kind0 == WAIT and kind1 == WAIT):
                        continue
                    cell1 = options[1, kind1, 1 + place1] if kind1 != WAIT else 0
                    goal0 = FREE if kind0 == WAIT else 1 + cell0
                    goal1 = FREE if kind1 == WAIT else 1 + cell1
                    own0 = 0 if kind0 == WAIT else way_alone(brain, state, 0, cell0)
                    own1 = 0 if kind1 == WAIT else way_alone(brain, state, 1, cell1)
                    together = joint_cost(brain.joint, goal0, goal1, pose0, pose1)
                    delay = 2 if together >= FAR else together - max(own0, own1)
                    if brain.pots[1]:
                        rated[count] = own0 + own1 + delay + 30 * ((kind0 == WAIT) + (kind1 == WAIT))
                    else:
                        rated[count] = pair_to_go(brain, state, orders, kind0, cell0, kind1, cell1, delay)
                    which[count, 0] = kind0
                    which[count, 1] = cell0
                    which[count, 2] = kind1
                    which[count, 3] = cell1
                    which[count, 4] = delay
                    count += 1
    return count
