"""Whole trials of a planning robot beside a myopic human, compiled."""

from __future__ import annotations

import numpy as np
from numpy import int16, uint8, uint64
from numpy.typing import NDArray

from galley.compiled.kernels import kernel, lean_kernel
from galley.compiled.randomness import draw
from galley.kitchen.codes import ACTIONS, CELLS, OUT_SIZE, TICK
from galley.kitchen.rules.shared import finished, reset
from galley.planning.kernels.myopic_kernel import MEMORY_SIZE, decide, remember
from galley.planning.kernels.robot_kernel import ROBOT_MEMORY, Brain, robot_action, robot_observe
from galley.planning.kernels.subtask_kernel import KINDS

MYOPIC = 0
MDP = 1
QMDP = 2

# Streams of random numbers, as in `myopic.py`; a robot has the first alone.
UNSTUCK = 0
NOISE = 1
NOISY_ACTION = 2
LENGTH = 3


@lean_kernel
def _myopic(
    brain: Brain, state: NDArray[int16], seat: int, seed: uint64, epsilon: float, memory: NDArray[int16]
) -> int:
    tick = state[TICK]
    if epsilon > 0 and draw(seed, seat, tick, NOISE) < epsilon:
        return int(draw(seed, seat, tick, NOISY_ACTION) * len(ACTIONS))
    random = draw(seed, seat, tick, UNSTUCK)
    return int(decide(brain.spec, brain.costs, brain.reach, state, seat, memory, random))


@kernel
def run_trials(
    brain: Brain, robot: int, seat: int, epsilon: float, robot_epsilon: float, seeds: NDArray[uint64],
    joint_actions: NDArray[uint8], ticks: NDArray[int16],
) -> None:  # fmt: skip
    """Play one trial per seed (uint64[B]) with the robot on `seat`, a myopic human on the other.

    Fills `joint_actions` uint8[B, T, 2] and `ticks` int16[B], the length of each.
    """
    size = CELLS + brain.joint.floor_of.size
    state = np.zeros(size, dtype=np.int16)
    after = np.zeros(size, dtype=np.int16)
    out = np.zeros(OUT_SIZE, dtype=np.int32)
    human = 1 - seat
    for trial in range(seeds.size):
        seed = seeds[trial]
        reset(brain.spec, state)
        memory = np.zeros(ROBOT_MEMORY, dtype=np.int16)
        belief = np.zeros(KINDS, dtype=np.float64)
        human_memory = np.zeros(MEMORY_SIZE, dtype=np.int16)
        robot_human_memory = np.zeros(MEMORY_SIZE, dtype=np.int16)
        tick = 0
        while tick < joint_actions.shape[1] and not finished(brain.spec, state):
            theirs = _myopic(brain, state, human, seed, epsilon, human_memory)
            if robot == MYOPIC:
                mine = _myopic(brain, state, seat, seed, robot_epsilon, robot_human_memory)
            else:
                mine = robot_action(
                    brain, state, seat, robot == MDP, memory, belief, draw(seed, seat, tick, UNSTUCK)
                )
            action0, action1 = (mine, theirs) if seat == 0 else (theirs, mine)
            joint_actions[trial, tick, 0] = action0
            joint_actions[trial, tick, 1] = action1
            remember(state, human, human_memory, theirs, mine, draw(seed, human, tick, LENGTH))
            if robot == MYOPIC:
                remember(state, seat, robot_human_memory, mine, theirs, draw(seed, seat, tick, LENGTH))
            robot_observe(brain, state, seat, memory, belief, action0, action1, after, out)
            state[:] = after
            tick += 1
        ticks[trial] = tick
