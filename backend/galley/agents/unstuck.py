"""The rule that gets agents moving again who repeat themselves on one spot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.compiled.kernels import kernel
from galley.kitchen.codes import CELL, CHEF, FACING


class Unstuck:
    """What B agents on one seat did in their last N ticks, and what the rule forbids them for it.

    Once at least N + 1 own ticks are on record and cell and facing equal those of each of the last N ticks,
    the actions taken in those N ticks are barred.

    Source: the human models of Carroll et al. 2019 (arXiv:1910.05789), N = 3.
    """

    def __init__(self, after_ticks: int, seat: int, size: int) -> None:
        self._seat = seat
        self._past: NDArray[np.int16] = np.zeros((after_ticks, size, 3), dtype=np.int16)
        self._ticks = 0

    def note(self, states: NDArray[np.int16], joint_actions: NDArray[np.integer]) -> None:
        """Put on record what was done (integer [B, 2]) in these states (int16 [B, S])."""
        now = self._past[self._ticks % len(self._past)]
        now[:, 0] = states[:, CHEF * self._seat + CELL]
        now[:, 1] = states[:, CHEF * self._seat + FACING]
        now[:, 2] = joint_actions[:, self._seat]
        self._ticks += 1

    def bar(self, states: NDArray[np.int16], barred: NDArray[np.bool_]) -> None:
        """Mark in `barred` (bool [B, 6]) the actions that are barred in these states (int16 [B, S])."""
        if self._ticks > len(self._past):
            _bar(self._past, states, CHEF * self._seat, barred)


@kernel
def _bar(past: NDArray[np.int16], states: NDArray[np.int16], at: int, barred: NDArray[np.bool_]) -> None:
    ticks = len(past)
    for row in range(len(states)):
        cell, facing = states[row, at + CELL], states[row, at + FACING]
        same = 0
        while same < ticks and past[same, row, 0] == cell and past[same, row, 1] == facing:
            same += 1
        if same == ticks:
            for tick in range(ticks):
                barred[row, past[tick, row, 2]] = True
