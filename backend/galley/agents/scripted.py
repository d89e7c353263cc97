"""Agents that need not look: one stays, one acts at random."""

from __future__ import annotations

from numpy import int16
from numpy.typing import NDArray

from galley.compiled.randomness import uniform
from galley.kitchen import ACTIONS, STAY, Layout


class Stay:
    """An agent that never moves."""

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode; there is nothing to forget."""

    def act(self, state: NDArray[int16], tick: int) -> int:
        """Always to stay."""
        return STAY

    def observe(self, state: NDArray[int16], joint_action: tuple[int, int]) -> None:
        """Take no note: nothing hangs on it."""


class Random:
    """An agent that takes each of the six actions with the same probability."""

    def __init__(self) -> None:
        self._seat, self._seed = 0, 0

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Draw from this seed and seat from now on."""
        self._seat, self._seed = seat, seed

    def act(self, state: NDArray[int16], tick: int) -> int:
        """An action drawn uniformly."""
        return int(uniform(self._seed, self._seat, tick) * len(ACTIONS))

    def observe(self, state: NDArray[int16], joint_action: tuple[int, int]) -> None:
        """Take no note: nothing hangs on it."""
