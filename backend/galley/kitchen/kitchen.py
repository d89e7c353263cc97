"""One running kitchen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.kitchen.codes import ACTIONS, INTERACT, OUT_SIZE, TICK
from galley.kitchen.events import Event, decode
from galley.kitchen.layout import Layout
from galley.kitchen.rules.shared import finished, reset
from galley.kitchen.rules.tick import step
from galley.kitchen.state import KitchenView, score_of, state_size, view


class Kitchen:
    """A kitchen that is stepped tick by tick.

    `state` int16[S] is the whole truth; copy it to keep it, or copy one into it to go on from there.
    """

    __slots__ = ("_before", "_spec", "layout", "out", "state")

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.state: NDArray[np.int16] = np.zeros(state_size(layout), dtype=np.int16)
        self.out: NDArray[np.int32] = np.zeros(OUT_SIZE, dtype=np.int32)
        self._before = self.state.copy()
        self._spec = layout.spec
        self.reset()

    def reset(self) -> None:
        """Set the kitchen back to its start."""
        reset(self._spec, self.state)
        self._before[:] = self.state
        self.out[:] = 0

    def step(self, a0: int, a1: int) -> int:
        """The reward of one tick with the actions of seat 0 and seat 1.

        Raises:
            ValueError: an action is not one of the six codes.
        """
        if not (0 <= a0 <= INTERACT and 0 <= a1 <= INTERACT):
            raise ValueError(f"actions must be codes from 0 to {len(ACTIONS) - 1}, not {a0!r} and {a1!r}")
        self._before[:] = self.state
        return int(step(self._spec, self.state, int(a0), int(a1), self.out))

    @property
    def tick(self) -> int:
        """Ticks played."""
        return int(self.state[TICK])

    @property
    def score(self) -> int:
        """Reward summed since the start."""
        return int(score_of(self.layout, self.state))

    @property
    def done(self) -> bool:
        """Whether the episode is over."""
        return bool(finished(self._spec, self.state))

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened in the last tick."""
        return decode(self.layout, self._before, self.state, self.out)

    @property
    def view(self) -> KitchenView:
        """The state for reading."""
        return view(self.layout, self.state)
