"""Joint motion of two chefs, compiled: tables of costs per pair of goals, filled when first asked for.

A table is found by breadth-first search backwards from its goals. Facings need not be searched: a chef
that still has to act may face anywhere, one that has settled at its goal only stays. So a chef is in one
of F + 4 states, F floor cells or settled at one of at most 4 goal poses, which is 16 times fewer joint
states than joint poses, and exact (`tests/planning/test_joint_motion.py` compares with joint poses).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy import int16, int32, int64, uint64
from numpy.typing import NDArray

from galley.compiled.kernels import kernel, lean_kernel
from galley.kitchen.codes import STAY

FAR = 32000
"""The cost of what cannot be reached."""
FREE = 0
"""The goal of a chef that may end anywhere."""
MOST_POSES = 4
NONE = -1
STEPS_KNOWN = 1 << 17
"""First ticks of joint plans that are kept; of two with one place the later stays."""
CODES = 64
"""More than any code of a joint action, 8 * action of seat 0 + action of seat 1."""


class JointTables(NamedTuple):
    """Arrays of one layout; F floor cells in row-major order, C cells, goals G = 1 + C + 4 F.

    Goal 0 is free, goal 1 + cell is to face that tile, goal 1 + C + 4 * floor + facing is that pose.
    `tables` int16[K, F + 4, F + 4] hold the K pairs of goals asked for most recently.
    """

    floor_of: NDArray[int16]  # [C], -1 where there is no floor
    cell_of: NDArray[int16]  # [F]
    ahead: NDArray[int16]  # [F, 4], floor number or -1
    ends: NDArray[int16]  # [G, 4], the poses (4 * floor + facing) that end a goal, then -1
    slot: NDArray[int32]  # [G, G], -1 when not filled
    pair: NDArray[int32]  # [K, 2], the goals of a slot
    used: NDArray[int32]  # [1], tables filled so far
    tables: NDArray[int16]
    queue: NDArray[int32]  # [(F + 4)^2], space to work in
    steps: NDArray[int64]  # [STEPS_KNOWN], what `known_step` was asked, times CODES, plus its answer; or 0


@lean_kernel
def _before(joint: JointTables, poses: NDArray[int16], state: int, bumps: bool, found: NDArray[int16]) -> int:
    """How many (state, action) of one chef may lead to `state`; written to `found` int16[9, 2]."""
    floors = joint.cell_of.size
    found[0, 0] = state
    found[0, 1] = STAY
    count = 1
    if state >= floors:
        floor = poses[state - floors] // 4
        facing = poses[state - floors] % 4
        behind = joint.ahead[floor, facing ^ 1]
        if behind >= 0:
            found[count, 0] = behind
            found[count, 1] = facing
            count += 1
        if joint.ahead[floor, facing] < 0 or bumps:
            found[count, 0] = floor
            found[count, 1] = facing
            count += 1
        return count
    for facing in range(STAY):
        behind = joint.ahead[state, facing ^ 1]
        if behind >= 0:
            found[count, 0] = behind
            found[count, 1] = facing
            count += 1
        if bumps and joint.ahead[state, facing] >= 0:
            found[count, 0] = state
            found[count, 1] = facing
            count += 1
    return count


@lean_kernel
def _faces_floor(joint: JointTables, poses: NDArray[int16], count: int) -> bool:
    found = False
    for index in range(count):
        found = found or joint.ahead[poses[index] // 4, poses[index] % 4] >= 0
    return found


@kernel
def _fill(joint: JointTables, goal0: int, goal1: int, table: NDArray[int16]) -> None:
    """Fill `table` int16[F + 4, F + 4] with the fewest ticks until both goals hold at once."""
    floors = joint.cell_of.size
    size = floors + MOST_POSES
    poses0 = joint.ends[goal0]
    poses1 = joint.ends[goal1]
    count0 = int((poses0 >= 0).sum())
    count1 = int((poses1 >= 0).sum())
    bumps = _faces_floor(joint, poses0, count0) or _faces_floor(joint, poses1, count1)
    cell0 = np.arange(size).astype(np.int16)
    cell1 = cell0.copy()
    for index in range(count0):
        cell0[floors + index] = poses0[index] // 4
    for index in range(count1):
        cell1[floors + index] = poses1[index] // 4
    table[:] = FAR
    queue = joint.queue
    last = 0
    first0, end0 = (0, floors) if goal0 == FREE else (floors, floors + count0)
    first1, end1 = (0, floors) if goal1 == FREE else (floors, floors + count1)
    for s0 in range(first0, end0):
        for s1 in range(first1, end1):
            if cell0[s0] != cell1[s1]:
                table[s0, s1] = 0
                queue[last] = s0 * size + s1
                last += 1
    # What may lead to each state, written down once: [state, which, (state, action)].
    ways0 = np.zeros((size, 9, 2), dtype=np.int16)
    ways1 = np.zeros((size, 9, 2), dtype=np.int16)
    number0 = np.zeros(size, dtype=np.int16)
    number1 = np.zeros(size, dtype=np.int16)
    for state in range(floors + count0):
        number0[state] = _before(joint, poses0, state, bumps, ways0[state])
    for state in range(floors + count1):
        number1[state] = _before(joint, poses1, state, bumps, ways1[state])
    first = 0
    while first < last:
        s0 = queue[first] // size
        s1 = queue[first] % size
        first += 1
        cost = table[s0, s1] + 1
        for i in range(number0[s0]):
            from0 = ways0[s0, i, 0]
            act0 = ways0[s0, i, 1]
            at0 = cell0[from0]
            to0 = at0
            if act0 < STAY and joint.ahead[at0, act0] >= 0:
                to0 = joint.ahead[at0, act0]
            for j in range(number1[s1]):
                from1 = ways1[s1, j, 0]
                if table[from0, from1] != FAR:
                    continue
                at1 = cell1[from1]
                if at0 == at1:
                    continue
                act1 = ways1[s1, j, 1]
                to1 = at1
                if act1 < STAY and joint.ahead[at1, act1] >= 0:
                    to1 = joint.ahead[at1, act1]
                if to0 == to1 or (to0 == at1 and to1 == at0):
                    fits = at0 == cell0[s0] and at1 == cell1[s1]
                else:
                    fits = to0 == cell0[s0] and to1 == cell1[s1]
                if fits:
                    table[from0, from1] = cost
                    queue[last] = from0 * size + from1
                    last += 1


@lean_kernel
def table_of(joint: JointTables, goal0: int, goal1: int) -> int:
    """The slot of the table for a pair of goals, filled now if need be in place of the oldest."""
    slot = joint.slot[goal0, goal1]
    if slot >= 0:
        return int(slot)
    slots = joint.tables.shape[0]
    slot = joint.used[0] % slots
    if joint.used[0] >= slots:
        joint.slot[joint.pair[slot, 0], joint.pair[slot, 1]] = NONE
    joint.used[0] += 1
    if joint.used[0] >= 2 * slots:  # keep the count from overflowing; all slots stay in use
        joint.used[0] -= slots
    _fill(joint, goal0, goal1, joint.tables[slot])
    joint.slot[goal0, goal1] = slot
    joint.pair[slot, 0] = goal0
    joint.pair[slot, 1] = goal1
    return int(slot)


@lean_kernel
def _settled(joint: JointTables, goal: int, pose: int) -> int:
    """The state of a chef that has settled at `pose`, or of its cell if `pose` does not end its goal."""
    for index in range(MOST_POSES):
        if joint.ends[goal, index] == pose:
            return joint.cell_of.size + index
    return pose // 4


@lean_kernel
def _cost(joint: JointTables, slot: int, goal0: int, goal1: int, pose0: int, pose1: int) -> int:
    """`joint_cost` from the table in a slot."""
    table = joint.tables[slot]
    s0 = _settled(joint, goal0, pose0)
    s1 = _settled(joint, goal1, pose1)
    floor0 = pose0 // 4
    floor1 = pose1 // 4
    # Whoever is where it should be may settle there or, to make way, move on.
    best = table[s0, s1]
    if s0 != floor0:
        best = min(best, table[floor0, s1])
        if s1 != floor1:
            best = min(best, table[floor0, floor1])
    if s1 != floor1:
        best = min(best, table[s0, floor1])
    return int(best)


@lean_kernel
def joint_cost(joint: JointTables, goal0: int, goal1: int, pose0: int, pose1: int) -> int:
    """The fewest ticks from poses (4 * floor + facing) until both goals hold at once; FAR if never."""
    if goal0 == FREE and goal1 == FREE:
        return 0
    return _cost(joint, table_of(joint, goal0, goal1), goal0, goal1, pose0, pose1)


@lean_kernel
def moved(joint: JointTables, pose0: int, pose1: int, act0: int, act1: int) -> tuple[int, int]:
    """The poses after one tick in which the chefs move or stay, as `galley.kitchen.rules.shared` has it."""
    at0 = pose0 // 4
    at1 = pose1 // 4
    facing0 = act0 if act0 < STAY else pose0 % 4
    facing1 = act1 if act1 < STAY else pose1 % 4
    to0 = at0
    to1 = at1
    if act0 < STAY and joint.ahead[at0, act0] >= 0:
        to0 = joint.ahead[at0, act0]
    if act1 < STAY and joint.ahead[at1, act1] >= 0:
        to1 = joint.ahead[at1, act1]
    if to0 == to1 or (to0 == at1 and to1 == at0):
        to0 = at0
        to1 = at1
    return 4 * to0 + facing0, 4 * to1 + facing1


@lean_kernel
def _alone(joint: JointTables, costs: NDArray[int16], goal: int, pose: int) -> int:
    """The fewest actions to a tile that is a goal, the other chef left out; 0 for other goals."""
    if goal == FREE or goal > joint.floor_of.size:
        return 0
    cost = costs[4 * joint.cell_of[pose // 4] + pose % 4, goal - 1]
    return FAR if cost < 0 else int(cost)


@lean_kernel
def joint_step(
    joint: JointTables, costs: NDArray[int16], goal0: int, goal1: int, pose0: int, pose1: int, first: int
) -> int:
    """8 * action of seat 0 + action of seat 1: the first tick of a joint plan; both stay if there is none.

    Among plans of fewest ticks: the chef of seat `first` as near its goal as can be, then the other,
    then the fewest moves, then the first in the order of action codes. `costs` are those of `distances`.
    """
    best = STAY * 8 + STAY
    if goal0 == FREE and goal1 == FREE:
        return best
    slot = table_of(joint, goal0, goal1)
    cost = _cost(joint, slot, goal0, goal1, pose0, pose1)
    if cost == 0 or cost >= FAR:
        return best
    score = np.int64(1) << 60
    for act0 in range(STAY + 1):
        for act1 in range(STAY + 1):
            new0, new1 = moved(joint, pose0, pose1, act0, act1)
            if _cost(joint, slot, goal0, goal1, new0, new1) != cost - 1:
                continue
            near0 = np.int64(_alone(joint, costs, goal0, new0))
            near1 = np.int64(_alone(joint, costs, goal1, new1))
            mine, others = (near0, near1) if first == 0 else (near1, near0)
            this = (mine * 65536 + others) * 4 + (act0 < STAY) + (act1 < STAY)
            if this < score:
                score = this
                best = 8 * act0 + act1
    return best


@lean_kernel
def step_with_way(
    joint: JointTables, costs: NDArray[int16], goal0: int, goal1: int, first: int, pose0: int, pose1: int
) -> int:
    """As `joint_step`, but the chef of seat `first` has the right of way: its goal is reached soonest."""
    best = STAY * 8 + STAY
    one, other = (goal0, FREE) if first == 0 else (FREE, goal1)
    slot = table_of(joint, one, other)
    both = table_of(joint, goal0, goal1)
    if joint.slot[one, other] != slot:  # the second table took the place of the first
        slot = table_of(joint, one, other)
    cost = _cost(joint, slot, one, other, pose0, pose1)
    if cost >= FAR:
        return best
    score = np.int64(1) << 60
    for act0 in range(STAY + 1):
        for act1 in range(STAY + 1):
            new0, new1 = moved(joint, pose0, pose1, act0, act1)
            left = _cost(joint, slot, one, other, new0, new1)
            if left > max(cost - 1, 0):
                continue
            together = np.int64(_cost(joint, both, goal0, goal1, new0, new1))
            near = _alone(joint, costs, goal0, new0) + _alone(joint, costs, goal1, new1)
            this = ((left * 65536 + together) * 65536 + near) * 4 + (act0 < STAY) + (act1 < STAY)
            if this < score:
                score = this
                best = 8 * act0 + act1
    return best


@lean_kernel
def known_step(
    joint: JointTables, costs: NDArray[int16], goal0: int, goal1: int, way: int, pose0: int, pose1: int
) -> int:
    """As `joint_step` for seat 0 (`way` 2) or `step_with_way` for a seat (`way` 0, 1), at once when known."""
    goals = int64(joint.ends.shape[0])
    poses = int64(4 * joint.cell_of.size)
    asked = ((((goal0 * goals + goal1) * poses + pose0) * poses + pose1) * 3 + way + 1) * CODES
    at = (uint64(asked) * uint64(0x9E3779B97F4A7C15)) >> uint64(64 - 17)
    if joint.steps[at] // CODES * CODES == asked:
        return int(joint.steps[at] % CODES)
    if way == 2:
        code = joint_step(joint, costs, goal0, goal1, pose0, pose1, 0)
    else:
        code = step_with_way(joint, costs, goal0, goal1, way, pose0, pose1)
    joint.steps[at] = asked + code
    return code
