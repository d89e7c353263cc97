"""All kernels of kitchens, planners and agents compiled, once: `python -m galley.agents.all_kernels`."""

from __future__ import annotations

import numpy as np

from galley.agents.choosing import choose
from galley.agents.episode import play_episode
from galley.agents.scripted import Stay
from galley.agents.unstuck import Unstuck
from galley.compiled.randomness import uniform
from galley.kitchen import ACTIONS, STAY, KitchenBatch, Layout, warm
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
        play_episode(layout, (agent, Stay()), seed=0)
    seeds = np.arange(2, dtype=np.uint64)
    for robot in ROBOTS:
        run(layout, robot, 0.1, seeds)
    logits = np.zeros((2, len(ACTIONS)), dtype=np.float32)
    barred = np.zeros(logits.shape, dtype=np.bool_)
    states, stayed = KitchenBatch(layout, 2).states, np.full((2, 2), STAY)
    unstuck = Unstuck(1, seat=0, size=2)
    for _ in range(2):
        unstuck.note(states, stayed)
    unstuck.bar(states, barred)
    choose(logits, barred, None)
    choose(logits, barred, uniform(seeds, 0, 0))


if __name__ == "__main__":
    warm_all()
