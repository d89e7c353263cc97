"""The planning robots: one that sees the human's subtask, one that infers it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.compiled.randomness import uniform
from galley.errors import GalleyError
from galley.kitchen.codes import OUT_SIZE
from galley.kitchen.layout import Layout
from galley.kitchen.state import state_size
from galley.planning.brain import brain
from galley.planning.kernels.robot_kernel import ROBOT_MEMORY, Brain, robot_action, robot_observe
from galley.planning.kernels.subtask_kernel import KINDS
from galley.planning.subtasks import SUBTASKS


class _Robot:
    """A robot that picks the subtask of least expected cost and goes there by joint motion plans."""

    sees = False

    def __init__(self) -> None:
        self._layout: Layout | None = None
        self._brain: Brain | None = None
        self._seat, self._seed = 0, 0
        self._memory = np.zeros(ROBOT_MEMORY, dtype=np.int16)
        self._belief = np.zeros(KINDS, dtype=np.float64)

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode; the values of a layout are computed when it or the seat changes.

        Raises:
            GalleyError: the layout cannot be served (the message names the station) or is too large.
        """
        if self._brain is None or layout != self._layout or seat != self._seat:
            self._brain = brain(layout, seat)
            self._layout = layout
        self._seat, self._seed = seat, seed
        self._memory[:] = 0
        self._belief[:] = 0
        self._after = np.zeros(state_size(layout), dtype=np.int16)
        self._out = np.zeros(OUT_SIZE, dtype=np.int32)

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """The first action of the joint plan to the best subtask; a random move to a free cell when stuck."""
        draw = uniform(self._seed, self._seat, tick)
        return int(
            robot_action(self._ready(), state, self._seat, self.sees, self._memory, self._belief, draw)
        )

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Update the belief from what the human did, and note who moved."""
        robot_observe(
            self._ready(), state, self._seat, self._memory, self._belief, joint_action[0], joint_action[1],
            self._after, self._out,
        )  # fmt: skip

    @property
    def belief(self) -> dict[str, float]:
        """The probability of each subtask that the human may be at, by name; empty before the first tick."""
        pairs = zip(SUBTASKS, self._belief.tolist(), strict=True)
        return {subtask.name: weight for subtask, weight in pairs if weight > 0}

    def _ready(self) -> Brain:
        if self._brain is None:
            raise GalleyError("the agent has no layout yet; call reset first")
        return self._brain


class MDP(_Robot):
    """A robot that sees the human's subtask, which is that of the myopic human in the present state.

    Source: Fontaine et al. 2021 (RSS), Sec. V: the baseline that fully observes the human subtask.
    """

    sees = True


class QMDP(_Robot):
    """A robot that keeps a belief over the human's subtasks and takes the best one under it.

    The belief is uniform over the feasible subtasks when the human has completed one; then each human
    action weighs every subtask by how much nearer it brought the human. What the robot does not do is
    act in order to learn (QMDP: certainty from the next step on).

    Source: Fontaine et al. 2021 (RSS), Sec. IV and App. B. Ours: passing over counters, several pots, order
    lists, soups on counters, and random moves only for a chef whose way did not open by itself.
    """
