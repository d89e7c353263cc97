"""All kernels of kitchens, planners and agents compiled, once: `python -m galley.agents.warm_up`."""

from __future__ import annotations

import numpy as np

from galley.agents.choosing import choose
from galley.compiled.randomness import uniform
from galley.kitchen import ACTIONS, STAY, Kitchen, Layout, warm
from galley.planning.centralized import Centralized
from galley.planning.myopic import Myopic
from galley.planning.robots import MDP, QMDP
from galley.planning.trials import ROBOTS, run

_TICKS = 6


def warm_all() -> None:
    """Compile, or fetch from Numba's cache, all that kitchens, planners and agents run compiled."""
    warm()
    layout = Layout.from_ascii("warm", "XPOX\nX12X\nXDSX", cook_time_ticks=2, horizon_ticks=_TICKS)
    for agent in (Myopic(0.1), MDP(), QMDP(), Centralized()):
        agent.reset(layout, 0, 0)
        kitchen = Kitchen(layout)
        for tick in range(_TICKS):
            state = kitchen.state.copy()
            joint_action = agent.act(state, tick), STAY
            kitchen.step(*joint_action)
            agent.observe(state, joint_action)
    seeds = np.arange(2, dtype=np.uint64)
    for robot in ROBOTS:
        run(layout, robot, 0.1, seeds)
    logits = np.zeros((2, len(ACTIONS)), dtype=np.float32)
    barred = np.zeros(logits.shape, dtype=np.bool_)
    choose(logits, barred, None)
    choose(logits, barred, uniform(seeds, 0, 0))


if __name__ == "__main__":
    warm_all()
