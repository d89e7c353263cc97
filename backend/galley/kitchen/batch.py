"""Many kitchens of one layout, stepped together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.kitchen.codes import (
    ACTIONS,
    BIT_FETCH,
    BIT_POT,
    BIT_USEFUL_DISH,
    ORDERS_DELIVERED,
    OUT_EVENTS,
    OUT_REWARD,
    OUT_SIZE,
    TICK,
)
from galley.kitchen.layout import Layout
from galley.kitchen.rules.shared import reset
from galley.kitchen.rules.tick import step_batch
from galley.kitchen.state import score_of, state_size

SHAPING_POTTING = 3.0
SHAPING_USEFUL_DISH = 3.0
SHAPING_SOUP_PICK_UP = 5.0


class KitchenBatch:
    """B kitchens: `states` int16[B,S] and, of the last tick, `out` int32[B,OUT_SIZE]."""

    def __init__(self, layout: Layout, size: int) -> None:
        self.layout = layout
        self.size = size
        self.states: NDArray[np.int16] = np.zeros((size, state_size(layout)), dtype=np.int16)
        self.out: NDArray[np.int32] = np.zeros((size, OUT_SIZE), dtype=np.int32)
        self._start = np.zeros(state_size(layout), dtype=np.int16)
        reset(layout.spec, self._start)
        self.reset()

    def reset(self, mask: NDArray[np.bool_] | None = None) -> None:
        """Set the kitchens where `mask` bool[B] is true (default: all) back to their start."""
        if mask is None:
            self.states[:] = self._start
        else:
            self.states[mask] = self._start

    def step(self, actions: NDArray[np.integer]) -> NDArray[np.int32]:
        """int32[B]: the rewards of one tick; `actions` is integer[B,2]. Finished kitchens do not change.

        Raises:
            ValueError: `actions` has another shape or holds something else than the six codes.
        """
        if actions.shape != (self.size, 2):
            raise ValueError(f"actions must have shape ({self.size}, 2), not {actions.shape}")
        if self.size and (actions.max() >= len(ACTIONS) or actions.min() < 0):
            raise ValueError(f"actions must be codes from 0 to {len(ACTIONS) - 1}")
        packed = np.ascontiguousarray(actions, dtype=np.uint8)
        step_batch(self.layout.spec, self.states, packed, self.out)
        return self.out[:, OUT_REWARD]

    @property
    def done(self) -> NDArray[np.bool_]:
        """bool[B]: which episodes are over."""
        done: NDArray[np.bool_] = self.states[:, TICK] >= self.layout.rules.horizon_ticks
        if self.layout.rules.orders is not None:
            done |= self.states[:, ORDERS_DELIVERED] >= len(self.layout.rules.orders)
        return done

    @property
    def ticks(self) -> NDArray[np.int16]:
        """int16[B]: ticks played by each."""
        return self.states[:, TICK].copy()

    @property
    def scores(self) -> NDArray[np.int32]:
        """int32[B]: reward summed since the start of each."""
        return score_of(self.layout, self.states)

    def shaping(self) -> NDArray[np.float32]:
        """float32[B,2]: the extra reward of each seat in the last tick, for learning.

        3 an ingredient into a pot, 3 a useful dish pick-up, 5 a soup from a pot.
        Source: Carroll et al. 2019, reward shaping parameters.
        """
        masks = self.out[:, OUT_EVENTS : OUT_EVENTS + 2]
        shaped = np.zeros(masks.shape, dtype=np.float32)
        shaped += SHAPING_POTTING * ((masks >> BIT_POT & 3) != 0)
        shaped += SHAPING_USEFUL_DISH * (masks >> BIT_USEFUL_DISH & 1)
        shaped += SHAPING_SOUP_PICK_UP * ((masks >> BIT_FETCH & 3) != 0)
        return shaped
