"""The decision of the planning robots, compiled: MDP (sees the human's subtask) and QMDP (infers it).

Source: Fontaine et al. 2021 (RSS), Sec. IV and App. B.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy import bool_, float32, float64, int16, int32, int64
from numpy.typing import NDArray

from galley.compiled.kernels import kernel, lean_kernel
from galley.kitchen.codes import (
    BIT_BLOCKED,
    CELL,
    CELLS,
    CHEF,
    DISH,
    FACING,
    HELD,
    INTERACT,
    NOTHING,
    ORDERS_DELIVERED,
    OUT_EVENTS,
    POT,
    SPEC_HEIGHT,
    SPEC_ORDERS,
    SPEC_POTS,
    SPEC_TILES,
    SPEC_WIDTH,
    STAY,
)
from galley.kitchen.pots import amount_in, is_soup, ticks_left
from galley.kitchen.rules.tick import step
from galley.planning.kernels.joint_kernel import FAR, FREE, JointTables, joint_cost, joint_step
from galley.planning.kernels.myopic_kernel import target, wander
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
    kind_of,
    subtasks,
)
from galley.planning.kernels.value_kernel import (
    AT_POT,
    FETCH_SOUP,
    FILL_POT,
    IDLE,
    IDLE_TICKS,
    MOST_FULL,
    MOST_ORDERS,
    PUT_DOWN,
    SERVE,
    TAKE_A_DISH,
    TAKE_INGREDIENT,
    WITH_DISH,
    WITH_INGREDIENT,
    WITH_SOUP,
    both_busy,
    robot_waits,
    world,
)

# What the robot remembers, int16 [ROBOT_MEMORY]: where both were the tick before, what both did, for how
# many ticks nobody has moved.
KNOWN = 0
POSES = 1  # cell and facing of seat 0, then of seat 1
ACTIONS_BEFORE = 5  # of seat 0, of seat 1
STILL = 7
ROBOT_MEMORY = 8

CROWDED_TICKS = 4
"""Added to both ways when no joint plan ends both, for instance two chefs bound for one narrow spot."""
WAIT_TICKS = 3.0
"""Added to the cost of waiting: the values know no crowd, where a robot would put its work off for ever."""
FARTHER_TICKS = 1.0
"""Added for each nearer tile of the same subtask: the values are not so exact that a longer way gains."""
LEAST = 0.1
"""The weight of an action that leads one tick away from a subtask, beside 1 + LEAST for one that changes
nothing and 2 + LEAST for one that leads a tick towards it."""
PATIENCE_TICKS = 3
"""Ticks without anyone moving after which a robot that waits for the human to make way moves itself."""


class Brain(NamedTuple):
    """All that a robot knows of a layout before an episode; arrays shared by every episode there."""

    spec: NDArray[int16]
    costs: NDArray[int16]  # as in Distances
    reach: NDArray[bool_]  # as in Distances
    joint: JointTables
    robot_next: NDArray[float32]  # as in value_kernel, for the robot's seat
    human_next: NDArray[float32]
    human_takes: NDArray[float64]
    unit: NDArray[float64]  # [1]
    pots: NDArray[int64]  # [2]: how many there are, and 1 where chefs must pass things over counters
    passing: NDArray[bool_]  # [H*W]: the counters over which a team may pass things


@lean_kernel
def task_of(kind: int) -> int:
    """The subtask of the value tables for a kind of subtask."""
    if kind in (TAKE_ONION, TAKE_TOMATO):
        return TAKE_INGREDIENT
    if kind == TAKE_DISH:
        return TAKE_A_DISH
    if kind == FILL:
        return FILL_POT
    if kind in (FETCH, TAKE_SOUP):
        return FETCH_SOUP
    if kind == DELIVER:
        return SERVE
    return PUT_DOWN if kind == DROP else IDLE


@lean_kernel
def _stand_of(held: int) -> int:
    if held == NOTHING:
        return AT_POT
    if held < DISH:
        return WITH_INGREDIENT
    return WITH_DISH if held == DISH else WITH_SOUP


@lean_kernel
def world_of(spec: NDArray[int16], state: NDArray[int16], lying_soup: bool) -> int:
    """The world of the value tables that a state is in; a soup on a counter counts as one in a pot."""
    count = 0
    full = 1 if lying_soup else 0
    first = SPEC_TILES + spec[SPEC_WIDTH] * spec[SPEC_HEIGHT]
    for pot in range(spec[SPEC_POTS]):
        packed = int(state[CELLS + spec[first + pot]])
        if is_soup(packed):
            full += 1
        else:
            count = max(count, amount_in(packed))
    orders = MOST_ORDERS
    if spec[SPEC_ORDERS] > 0:
        orders = min(MOST_ORDERS, max(1, spec[SPEC_ORDERS] - state[ORDERS_DELIVERED]))
    return world(count, min(full, MOST_FULL), orders)


@lean_kernel
def pose_of(brain: Brain, state: NDArray[int16], seat: int) -> int:
    """The pose of a chef: 4 * floor number + facing."""
    chef = CHEF * seat
    return int(4 * brain.joint.floor_of[state[chef + CELL]] + state[chef + FACING])


@lean_kernel
def way_alone(brain: Brain, state: NDArray[int16], seat: int, cell: int) -> int:
    """The fewest actions of a chef to a tile, the other left out of account."""
    chef = CHEF * seat
    return int(brain.costs[4 * state[chef + CELL] + state[chef + FACING], cell])


@lean_kernel
def cooks_for(brain: Brain, state: NDArray[int16], cell: int) -> int:
    """The ticks until the soup in a full pot is ready; 0 for anything else."""
    packed = int(state[CELLS + cell])
    if brain.spec[SPEC_TILES + cell] != POT or not is_soup(packed):
        return 0
    return ticks_left(brain.spec, packed)


@lean_kernel
def pair_cost(brain: Brain, state: NDArray[int16], seat: int, mine: int, others: int) -> int:
    """The ticks until both chefs face their tiles (-1: anywhere) by a joint plan; FAR if there is none."""
    goal = FREE if mine < 0 else 1 + mine
    other = FREE if others < 0 else 1 + others
    pose0, pose1 = pose_of(brain, state, 0), pose_of(brain, state, 1)
    if seat == 0:
        return joint_cost(brain.joint, goal, other, pose0, pose1)
    return joint_cost(brain.joint, other, goal, pose0, pose1)


@lean_kernel
def _cost_to_go(
    brain: Brain, state: NDArray[int16], seat: int, kind: int, cell: int, human: int, human_cell: int
) -> float:
    """The expected ticks until the orders ahead are served if the robot takes up `kind` at `cell` now."""
    human_task = task_of(human)
    human_left = IDLE_TICKS
    alone = 0
    if human_cell >= 0:
        alone = way_alone(brain, state, 1 - seat, human_cell)
        human_left = float(max(alone, cooks_for(brain, state, human_cell)) + 1)
    own = 0 if cell < 0 else way_alone(brain, state, seat, cell)
    delay = 0
    if cell >= 0 or human_cell >= 0:
        together = pair_cost(brain, state, seat, cell, human_cell)
        delay = min(own, alone) + CROWDED_TICKS if together >= FAR else together - max(own, alone)
    if brain.pots[1]:  # what must pass over counters is not in the value tables: a rank decides
        return float(own + delay + _rank(kind))
    at = world_of(brain.spec, state, kind == TAKE_SOUP or human == TAKE_SOUP)
    pots, unit = int(brain.pots[0]), brain.unit[0]
    if alone > own:  # the chef with the longer way is the one that is held up
        human_left += delay
    if cell < 0:
        stand = _stand_of(state[CHEF * seat + HELD])
        return WAIT_TICKS + robot_waits(
            stand, human_task, human_left, at, pots, unit, brain.human_takes, brain.robot_next, False
        )
    left = float(max(own, cooks_for(brain, state, cell)) + 1)
    if alone <= own:
        left += delay
    return both_busy(
        task_of(kind), left, human_task, human_left, at, pots, unit, brain.robot_next, brain.human_next
    )


@lean_kernel
def _rank(kind: int) -> int:
    """The ticks by which the state machine puts a kind of subtask behind others."""
    if kind == WAIT:
        return 2000
    if kind == TAKE_DISH:
        return 20
    return 40 if kind in (TAKE_ONION, TAKE_TOMATO) else 0


@kernel
def likely(
    brain: Brain, state: NDArray[int16], seat: int, sees: bool, belief: NDArray[float64],
    weights: NDArray[float64], cells: NDArray[int64],
) -> int:  # fmt: skip
    """The human's likeliest subtask; fills the weight (float64[KINDS]) and tile (int64[KINDS]) of each.

    A robot that sees has one certain subtask: that of the myopic human in this state. Otherwise weights are
    the belief over the feasible subtasks, uniform while there is none.
    """
    human = 1 - seat
    weights[:] = 0
    cells[:] = -1
    if sees:
        cell = target(brain.spec, brain.costs, brain.reach, state, human)
        kind = kind_of(brain.spec, state, human, cell)
        weights[kind] = 1
        cells[kind] = cell
        return kind
    feasible = np.zeros((KINDS, 4), dtype=np.int16)
    subtasks(brain.spec, brain.costs, brain.reach, state, human, feasible)
    total = 0.0
    ways = 0
    for kind in range(KINDS):
        if feasible[kind, 0] > 0:
            cells[kind] = feasible[kind, 1]
            weights[kind] = belief[kind]
            total += belief[kind]
            ways += 1
    if ways == 0:
        weights[WAIT] = 1
        return WAIT
    best = WAIT
    for kind in range(KINDS):
        if feasible[kind, 0] > 0:
            weights[kind] = weights[kind] / total if total > 0 else 1 / ways
            if best == WAIT or weights[kind] > weights[best]:
                best = kind
    return best


@kernel
def choose(
    brain: Brain, state: NDArray[int16], seat: int, weights: NDArray[float64], cells: NDArray[int64],
    values: NDArray[float64],
) -> tuple[int, int]:  # fmt: skip
    """(kind, cell) of the robot's best subtask; `values` float64[KINDS] are -Q, -inf if not feasible."""
    feasible = np.zeros((KINDS, 4), dtype=np.int16)
    subtasks(brain.spec, brain.costs, brain.reach, state, seat, feasible)
    values[:] = -np.inf
    best_kind, best_cell = WAIT, -1
    best = np.inf
    for kind in range(KINDS - 1, -1, -1):  # to wait comes last, so that of equals something is done
        count = feasible[kind, 0] if kind != WAIT else 1
        for index in range(count):
            cell = -1 if kind == WAIT else int(feasible[kind, 1 + index])
            cost = FARTHER_TICKS * index
            for human in range(KINDS):
                if weights[human] > 0:
                    cost += weights[human] * _cost_to_go(brain, state, seat, kind, cell, human, cells[human])
            values[kind] = max(values[kind], -cost)
            if cost < best - 1e-6:
                best = cost
                best_kind, best_cell = kind, cell
    return best_kind, best_cell


@lean_kernel
def _toward(brain: Brain, state: NDArray[int16], seat: int, cell: int, human_cell: int) -> int:
    """The robot's part in the first tick of the joint plan to both tiles (-1: anywhere)."""
    mine, others = cell, human_cell
    if pair_cost(brain, state, seat, mine, others) >= FAR:
        # Both cannot be done at once: who is nearer goes first.
        if way_alone(brain, state, seat, cell) <= way_alone(brain, state, 1 - seat, human_cell):
            others = -1
        else:
            mine = -1
    goal = FREE if mine < 0 else 1 + mine
    other = FREE if others < 0 else 1 + others
    pose0, pose1 = pose_of(brain, state, 0), pose_of(brain, state, 1)
    if seat == 0:
        return joint_step(brain.joint, brain.costs, goal, other, pose0, pose1, 0) // 8
    return joint_step(brain.joint, brain.costs, other, goal, pose0, pose1, 1) % 8


@kernel
def robot_action(
    brain: Brain, state: NDArray[int16], seat: int, sees: bool, memory: NDArray[int16],
    belief: NDArray[float64], draw: float,
) -> int:  # fmt: skip
    """The robot's action; `draw` in [0, 1) settles a random move when it is stuck."""
    weights = np.empty(KINDS, dtype=np.float64)
    cells = np.empty(KINDS, dtype=np.int64)
    values = np.empty(KINDS, dtype=np.float64)
    human = likely(brain, state, seat, sees, belief, weights, cells)
    kind, cell = choose(brain, state, seat, weights, cells, values)
    at_work = cell >= 0 and way_alone(brain, state, seat, cell) == 0
    if at_work and not (kind == FETCH and cooks_for(brain, state, cell) > 0):
        return INTERACT
    action = STAY
    if cell >= 0 or cells[human] >= 0:
        action = _toward(brain, state, seat, cell, cells[human])
    if stuck(state, memory) or (
        memory[STILL] >= PATIENCE_TICKS and action == STAY and cell >= 0 and not at_work
    ):
        move = wander(brain.spec, state, seat, -1, draw)
        return action if move < 0 else move
    return action


@lean_kernel
def stuck(state: NDArray[int16], memory: NDArray[int16]) -> bool:
    """Whether someone tried to move and both chefs' cells and facings are as they were."""
    if not memory[KNOWN] or not _still(state, memory):
        return False
    return bool(memory[ACTIONS_BEFORE] < STAY or memory[ACTIONS_BEFORE + 1] < STAY)


@lean_kernel
def _still(state: NDArray[int16], memory: NDArray[int16]) -> bool:
    return bool(
        state[CELL] == memory[POSES]
        and state[FACING] == memory[POSES + 1]
        and state[CHEF + CELL] == memory[POSES + 2]
        and state[CHEF + FACING] == memory[POSES + 3]
    )


@kernel
def robot_observe(
    brain: Brain, state: NDArray[int16], seat: int, memory: NDArray[int16], belief: NDArray[float64],
    action0: int, action1: int, after: NDArray[int16], out: NDArray[int32],
) -> None:  # fmt: skip
    """Note what both did in `state` and update the belief; `after` int16[S] becomes the next state.

    The belief is uniform over the feasible subtasks when the human has done one. Otherwise each subtask's
    weight is multiplied by 1 + LEAST + the ticks by which the human's action shortened its way there.
    """
    human = 1 - seat
    after[:] = state
    step(brain.spec, after, action0, action1, out)
    memory[STILL] = memory[STILL] + 1 if memory[KNOWN] and _still(state, memory) else 0
    memory[KNOWN] = 1
    memory[POSES] = state[CELL]
    memory[POSES + 1] = state[FACING]
    memory[POSES + 2] = state[CHEF + CELL]
    memory[POSES + 3] = state[CHEF + FACING]
    memory[ACTIONS_BEFORE] = action0
    memory[ACTIONS_BEFORE + 1] = action1

    feasible = np.zeros((KINDS, 4), dtype=np.int16)
    subtasks(brain.spec, brain.costs, brain.reach, after, human, feasible)
    ways = 0
    for kind in range(KINDS):
        ways += feasible[kind, 0] > 0
    finished = out[OUT_EVENTS + human] & ~(1 << BIT_BLOCKED) != 0
    known = belief.sum() > 0
    action = action1 if seat == 0 else action0
    total = 0.0
    for kind in range(KINDS):
        if feasible[kind, 0] == 0:
            belief[kind] = 0
            continue
        if finished or not known:
            belief[kind] = 1 / ways
        else:
            before = FAR
            now = FAR
            for index in range(feasible[kind, 0]):
                before = min(before, way_alone(brain, state, human, feasible[kind, 1 + index]))
                now = min(now, way_alone(brain, after, human, feasible[kind, 1 + index]))
            shorter = before - now
            if now == 0 and action >= STAY:
                shorter = 1  # it waits where it should be
            # What became feasible only now starts as if it had been believed a little all along.
            belief[kind] = max(belief[kind], 0.01) * (1 + LEAST + max(-1, min(1, shorter)))
        total += belief[kind]
    if total > 0:
        belief /= total
