"""Random numbers without state: each is a function of a seed, a seat and a tick."""

from __future__ import annotations

from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

_STEP = 0x9E3779B97F4A7C15
_FIRST = 0xBF58476D1CE4E5B9
_SECOND = 0x94D049BB133111EB
_WORD = (1 << 64) - 1


@overload
def uniform(seed: int, seat: int, tick: int, stream: int = 0) -> float: ...


@overload
def uniform(
    seed: ArrayLike, seat: ArrayLike, tick: ArrayLike, stream: ArrayLike = 0
) -> NDArray[np.float64]: ...


def uniform(seed: Any, seat: Any, tick: Any, stream: Any = 0) -> float | NDArray[np.float64]:
    """A float64 in [0, 1), the same whenever asked with the same four whole numbers.

    Whole numbers give a float; arrays are broadcast and give an array of float64 with equal values.
    Different streams are for different purposes of one agent within one tick. Numbers count modulo 2^64.

    Source: the SplitMix64 finaliser (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number
    Generators", OOPSLA 2014, Fig. 17), chained over the four numbers.
    """
    parts = (seed, seat, tick, stream)
    if all(isinstance(part, (int, np.integer)) for part in parts):
        word = 0
        for part in parts:
            word = _mixed((word ^ (int(part) & _WORD)) + _STEP & _WORD)
        return (word >> 11) * 2.0**-53
    arrays = [np.atleast_1d(_words(part)) for part in parts]
    words = np.zeros(np.broadcast_shapes(*(array.shape for array in arrays)), dtype=np.uint64)
    for array in arrays:
        words = _mixed_array((words ^ array) + np.uint64(_STEP))
    return (words >> np.uint64(11)).astype(np.float64) * 2.0**-53


def _words(numbers: ArrayLike) -> NDArray[np.uint64]:
    if isinstance(numbers, int):
        return np.asarray(numbers & _WORD, dtype=np.uint64)
    return np.asarray(numbers).astype(np.uint64)


def _mixed(word: int) -> int:
    word = (word ^ (word >> 30)) * _FIRST & _WORD
    word = (word ^ (word >> 27)) * _SECOND & _WORD
    return word ^ (word >> 31)


def _mixed_array(words: NDArray[np.uint64]) -> NDArray[np.uint64]:
    words = (words ^ (words >> np.uint64(30))) * np.uint64(_FIRST)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(_SECOND)
    return words ^ (words >> np.uint64(31))
