"""Many trials of a robot and a simulated human on one layout."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from galley.kitchen.layout import Layout
from galley.planning.brain import brain
from galley.planning.kernels.trial_kernel import MDP, MYOPIC, NOISE, NOISY_ACTION, QMDP, run_trials

__all__ = ["NOISE", "NOISY_ACTION", "ROBOTS", "Trials", "run"]

ROBOTS: Final = {"myopic": MYOPIC, "mdp": MDP, "qmdp": QMDP}
"""The robots that play whole trials compiled."""


@dataclass(frozen=True, eq=False)
class Trials:
    """B trials: `joint_actions` uint8[B, T, 2], of which the first `ticks` int16[B] were played."""

    joint_actions: NDArray[np.uint8]
    ticks: NDArray[np.int16]


def run(
    layout: Layout, robot: str, epsilon: float, seeds: NDArray[np.uint64], seat: int = 0,
    robot_epsilon: float = 0.0,
) -> Trials:  # fmt: skip
    """One trial per seed (uint64[B]) of the layout's horizon: the robot on `seat`, a myopic human opposite.

    The human makes a random action with probability `epsilon`. The same actions come from the agents
    of `robots.py` and `myopic.py` asked tick by tick with the same seeds.

    Raises:
        GalleyError: the layout cannot be served or is too large.
    """
    joint_actions = np.zeros((len(seeds), layout.rules.horizon_ticks, 2), dtype=np.uint8)
    ticks = np.zeros(len(seeds), dtype=np.int16)
    run_trials(brain(layout, seat), ROBOTS[robot], seat, epsilon, robot_epsilon, seeds, joint_actions, ticks)
    return Trials(joint_actions, ticks)
