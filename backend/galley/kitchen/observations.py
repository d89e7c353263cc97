"""Encodings of a kitchen's state for policies."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import observation_kernels as kernels
from galley.kitchen.action_costs import action_costs
from galley.kitchen.codes import (
    COUNTER,
    DISH_DISPENSER,
    ONION_DISPENSER,
    POT,
    SERVING,
    TOMATO_DISPENSER,
)
from galley.kitchen.layout import Layout
from galley.kitchen.state import state_size

ENCODINGS: Final[dict[str, str]] = {
    "grid": "26 channels [C, H, W] of whole numbers: the field's present lossless encoding.",
    "overcooked-2019-grid": "20 channels [W, H, C] of whole numbers: what agents of 2019 were trained on.",
    "overcooked-2019-features": "62 numbers made by hand, for behaviour cloning as in 2019.",
}
"""Every encoding that an agent bundle may name, with its meaning."""

GRID_CHANNELS: Final = 26
_GRID_STATIC: Final = (POT, COUNTER, ONION_DISPENSER, TOMATO_DISPENSER, DISH_DISPENSER, SERVING)
_GRID_2019_STATIC: Final = (POT, COUNTER, ONION_DISPENSER, DISH_DISPENSER, SERVING)
_FIRST_STATIC: Final = 10
_FEATURES: Final = 62

_BOTH = np.array([[0, 1]], dtype=np.int64)  # a kernel for what is read only would be compiled besides


class Encoder:
    """One encoding for one layout; `shape` and `dtype` are those of one seat's observation.

    Raises:
        GalleyError: the encoding is unknown, or one of 2019 is asked for a layout with tomatoes,
            which those encodings cannot show.
    """

    def __init__(self, layout: Layout, name: str) -> None:
        if name not in ENCODINGS:
            raise GalleyError(f"encoding {name!r} is unknown; use one of {' '.join(ENCODINGS)}")
        if name != "grid" and (layout.tomatoes or "tomato" in (layout.rules.orders or ())):
            raise GalleyError(
                f"encoding {name} cannot show tomatoes, which layout {layout.name} has; use encoding grid"
            )
        self.layout = layout
        self.name = name
        self.dtype: np.dtype[Any] = np.dtype(np.float32 if name == "overcooked-2019-features" else np.uint8)
        height, width = layout.tiles.shape
        if name == "grid":
            self.shape: tuple[int, ...] = (GRID_CHANNELS, height, width)
            self._static = _static(layout, _GRID_STATIC, self.shape)
        elif name == "overcooked-2019-grid":
            self.shape = (width, height, kernels.C_CHANNELS)
            channels_first = _static(layout, _GRID_2019_STATIC, (kernels.C_CHANNELS, height, width))
            self._static = channels_first.transpose(2, 1, 0)
        else:
            self.shape = (_FEATURES,)
            kinds = (layout.onions, layout.pots, layout.dishes, layout.servings)
            listed = [(kind, layout.cell(place)) for kind, places in enumerate(kinds) for place in places]
            self._targets = np.array(listed, dtype=np.int16).reshape(-1, 2)
            self._costs = action_costs(layout, self._targets[:, 1])
        if name != "overcooked-2019-features":
            self._static = np.ascontiguousarray(self._static).reshape(-1)

    @property
    def map(self) -> NDArray[np.uint8]:
        """uint8 [*shape]: what an observation shows of the layout itself, in every state; zeros elsewhere."""
        if self.name == "overcooked-2019-features":
            return np.zeros(self.shape, dtype=np.uint8)
        return self._static.reshape(self.shape).copy()

    def both(self, states: NDArray[np.int16], out: NDArray[Any] | None = None) -> NDArray[Any]:
        """[B,2,*shape]: what seat 0 and seat 1 see in `states` int16[B,S]; written into `out` if given."""
        return self._encode(states, _BOTH, (len(states), 2, *self.shape), out)

    def seat(
        self, states: NDArray[np.int16], seats: NDArray[np.integer] | int, out: NDArray[Any] | None = None
    ) -> NDArray[Any]:
        """[B,*shape]: what one seat of each kitchen sees; `seats` is one seat or integer[B]."""
        chosen = np.asarray(seats, dtype=np.int64).reshape(-1, 1)
        if chosen.size not in (1, len(states)) or ((chosen != 0) & (chosen != 1)).any():
            raise ValueError(f"seats must be 0 or 1, one or one for each of {len(states)} kitchens")
        return self._encode(states, chosen, (len(states), *self.shape), out)

    def _encode(
        self,
        states: NDArray[np.int16],
        seats: NDArray[np.int64],
        shape: tuple[int, ...],
        out: NDArray[Any] | None,
    ) -> NDArray[Any]:
        size = state_size(self.layout)
        if states.ndim != 2 or states.shape[1] != size or states.dtype != np.int16:
            raise ValueError(f"states must be int16 [B, {size}], not {states.dtype} {list(states.shape)}")
        if out is None:
            out = np.empty(shape, dtype=self.dtype)
        elif out.shape != shape or out.dtype != self.dtype or not out.flags.c_contiguous:
            raise ValueError(f"out must be contiguous {self.dtype} {list(shape)}")
        flat = out.reshape(len(states), seats.shape[1], -1)
        rows = np.ascontiguousarray(states)
        spec = self.layout.spec
        if self.name == "grid":
            kernels.grid(spec, self._static, rows, seats, flat)
        elif self.name == "overcooked-2019-grid":
            kernels.grid_2019(spec, self._static, rows, seats, flat)
        else:
            kernels.features_2019(spec, self._costs, self._targets, rows, seats, flat)
        return out


def _static(layout: Layout, tiles: tuple[int, ...], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """uint8[C,H,W]: the channels of the map; all others zero."""
    static = np.zeros(shape, dtype=np.uint8)
    for channel, tile in enumerate(tiles, _FIRST_STATIC):
        static[channel] = layout.tiles == tile
    return static
