"""The myopic human: the subtask that matters most now, by the shortest way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.compiled.randomness import uniform
from galley.kitchen import ACTIONS, Layout
from galley.kitchen.codes import TICK
from galley.planning.distances import distances
from galley.planning.kernels.myopic_kernel import MEMORY_SIZE, decide, remember

UNSTUCK, NOISE, NOISY_ACTION, LENGTH = range(4)
"""Streams of random numbers."""


class Myopic:
    """A human model that looks at the world as it is, takes the subtask of highest priority and walks there.

    Each tick anew, holding
    - nothing: fetch a soup that lies about and can be served; else a dish if a soup cooks or is ready and no
      dish is on its way; else an ingredient if a pot can take one;
    - an ingredient: put it into the nearest pot that can take it, else put it on a counter;
    - a dish: go to the pot where a soup is had soonest and wait there if it cooks, else put the dish down;
    - a soup: serve it, or put it down while another order comes first.

    Where the chefs stand apart, what only one can get and the other needs is put on a counter that both
    reach, and taken from there. The other chef is no obstacle to planning: a chef whose move changed neither
    cell nor facing makes 1 to 4 random moves to free cells, and one who stands idle where the other wants to
    go makes one. With probability `epsilon` an action is drawn at random from all six.

    Source: the greedy human model of Carroll et al. 2019 (arXiv:1910.05789) as used in Fontaine et al. 2021
    (RSS, Sec. IV "Human Planner", App. B and Fig. 9, for the subtasks and the random moves when stuck). Ours:
    passing over counters, order lists, tomatoes, the number of random moves, and that standing still on
    purpose (waiting at a pot) does not count as stuck.
    """

    def __init__(self, epsilon: float = 0.0) -> None:
        self.epsilon = epsilon
        self._layout: Layout | None = None
        self._memory = np.zeros(MEMORY_SIZE, dtype=np.int16)
        self._seat, self._seed = 0, 0

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode; the distances of a layout are computed when it first comes or changes.

        Raises:
            GalleyError: the layout is too large for tables of distances.
        """
        if layout != self._layout:
            found = distances(layout)
            self._spec, self._costs, self._reach = layout.spec, found.costs, found.reachable
            self._layout = layout
        self._seat, self._seed = seat, seed
        self._memory[:] = 0

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """The first action of the shortest way to the present subtask, or a random one."""
        if self.epsilon > 0 and uniform(self._seed, self._seat, tick, NOISE) < self.epsilon:
            return int(uniform(self._seed, self._seat, tick, NOISY_ACTION) * len(ACTIONS))
        draw = uniform(self._seed, self._seat, tick, UNSTUCK)
        return int(decide(self._spec, self._costs, self._reach, state, self._seat, self._memory, draw))

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Note where both stood and what both did."""
        seat = self._seat
        draw = uniform(self._seed, seat, int(state[TICK]), LENGTH)
        remember(state, seat, self._memory, joint_action[seat], joint_action[1 - seat], draw)
