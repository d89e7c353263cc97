"""The compiled first convolution of a policy on sparse observations.

An observation of a kitchen is the layout's map, the same for every tick, and a handful of numbers besides:
where the chefs stand and look, what lies, is held or cooks. A convolution is linear, so that of the map is
worked out once, and each other number adds its filters where it reaches: about 1 % of the dense work.

Arrays are flat: `observations` uint8 [B, C*H*W]; `filters` float32 [C, K, K*F], whose last axis runs over the
columns *backwards* (K) and the filters (F), so that what one number adds to a row of the result is
contiguous; results float32 [B, H*W*F], channels last. The convolution is "same": K odd, zeros around.
"""

from __future__ import annotations

import numpy as np
from numpy import float32, int32, uint8
from numpy.typing import NDArray

from galley.compiled.kernels import numeric_kernel

_BLOCK = 64


@numeric_kernel
def differing(seen: NDArray[uint8], map_: NDArray[uint8], places: NDArray[int32]) -> int:
    """How many numbers of `seen` differ from `map_`, both uint8 [C*H*W]; fills `places` with where."""
    found = 0
    whole = seen.size // _BLOCK * _BLOCK
    for start in range(0, whole, _BLOCK):  # always of one length, so that it is compared in one go
        different = 0
        for place in range(start, start + _BLOCK):
            different |= seen[place] ^ map_[place]
        if different:
            for place in range(start, start + _BLOCK):
                if seen[place] != map_[place]:
                    places[found] = place
                    found += 1
    for place in range(whole, seen.size):
        if seen[place] != map_[place]:
            places[found] = place
            found += 1
    return found


@numeric_kernel
def spread(
    seen: NDArray[uint8], map_: NDArray[uint8], places: NDArray[int32], filters: NDArray[float32],
    height: int, width: int, out: NDArray[float32],
) -> None:  # fmt: skip
    """Add the convolution of `seen` - `map_`, not 0 at `places`, to `out` float32 [H*W*F]."""
    reach = filters.shape[1] // 2
    count = filters.shape[2] // filters.shape[1]
    for place in places:
        number = float32(seen[place]) - float32(map_[place])
        channel, cell = place // (height * width), place % (height * width)
        y, x = cell // width, cell % width
        first, last = max(0, x - reach), min(width, x + reach + 1)
        skipped = (first - x + reach) * count
        for row in range(max(0, y - reach), min(height, y + reach + 1)):
            into = out[(row * width + first) * count : (row * width + last) * count]
            weights = filters[channel, y - row + reach, skipped : skipped + into.size]
            for index in range(into.size):
                into[index] += number * weights[index]


@numeric_kernel
def gather(
    seen: NDArray[uint8], map_: NDArray[uint8], places: NDArray[int32], gradient: NDArray[float32],
    height: int, width: int, out: NDArray[float32],
) -> None:  # fmt: skip
    """Add to `out` float32 [C, K, K*F] what `gradient` [H*W*F] asks: the transpose of `spread`."""
    reach = out.shape[1] // 2
    count = out.shape[2] // out.shape[1]
    for place in places:
        number = float32(seen[place]) - float32(map_[place])
        channel, cell = place // (height * width), place % (height * width)
        y, x = cell // width, cell % width
        first, last = max(0, x - reach), min(width, x + reach + 1)
        skipped = (first - x + reach) * count
        for row in range(max(0, y - reach), min(height, y + reach + 1)):
            asked = gradient[(row * width + first) * count : (row * width + last) * count]
            into = out[channel, y - row + reach, skipped : skipped + asked.size]
            for index in range(asked.size):
                into[index] += number * asked[index]


@numeric_kernel
def convolve(
    observations: NDArray[uint8], map_: NDArray[uint8], filters: NDArray[float32], of_map: NDArray[float32],
    height: int, width: int, slope: float, out: NDArray[float32],
) -> None:  # fmt: skip
    """Fill `out` with the leaky ReLU of the convolution; `of_map` [H*W*F] is that of the map."""
    lower = float32(slope)
    places = np.empty(map_.size, dtype=int32)
    for index in range(observations.shape[0]):
        found = differing(observations[index], map_, places)
        row = out[index]
        row[:] = of_map
        spread(observations[index], map_, places[:found], filters, height, width, row)
        for place in range(row.size):
            row[place] = max(row[place], lower * row[place])


@numeric_kernel
def convolve_back(
    observations: NDArray[uint8], map_: NDArray[uint8], out: NDArray[float32], gradient: NDArray[float32],
    height: int, width: int, slope: float, of_filters: NDArray[float32], of_map: NDArray[float32],
) -> None:  # fmt: skip
    """Add the gradients of `filters` to `of_filters` [C, K, K*F], of the map's to `of_map`."""
    lower = float32(slope)
    asked = np.empty(out.shape[1], dtype=float32)
    places = np.empty(map_.size, dtype=int32)
    for index in range(observations.shape[0]):
        for place in range(asked.size):
            value = gradient[index, place]
            asked[place] = value if out[index, place] > 0 else lower * value
            of_map[place] += asked[place]
        found = differing(observations[index], map_, places)
        gather(observations[index], map_, places[:found], asked, height, width, of_filters)
