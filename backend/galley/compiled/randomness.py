"""Random numbers without state: each is a function of a seed, a seat and a tick."""

from __future__ import annotations

from typing import Any, overload

import numpy as np
from numpy import float64, uint64
from numpy.typing import ArrayLike, NDArray

from galley.compiled.kernels import kernel, lean_kernel

_STEP = 0x9E3779B97F4A7C15
_FIRST = 0xBF58476D1CE4E5B9
_SECOND = 0x94D049BB133111EB
_WORD = (1 << 64) - 1
_SPACING = 2.0**-53


@overload
def uniform(seed: int, seat: int, tick: int, stream: int = 0) -> float: ...


@overload
def uniform(seed: ArrayLike, seat: ArrayLike, tick: ArrayLike, stream: int = 0) -> NDArray[float64]: ...


def uniform(seed: Any, seat: Any, tick: Any, stream: int = 0) -> float | NDArray[float64]:
    """A float64 in [0, 1), the same whenever asked with the same four whole numbers.

    Whole numbers give a float; arrays are broadcast and give an array of float64 with equal values.
    Different streams are for different purposes of one agent within one tick. Numbers count modulo 2^64.

    Source: the SplitMix64 finaliser (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number
    Generators", OOPSLA 2014, Fig. 17), chained over the four numbers.
    """
    if all(isinstance(part, (int, np.integer)) for part in (seed, seat, tick)):
        word = 0
        for part in (seed, seat, tick, stream):
            word = _mixed((word ^ (int(part) & _WORD)) + _STEP & _WORD)
        return (word >> 11) * _SPACING
    seeds, seats, ticks = np.broadcast_arrays(*(np.atleast_1d(_words(part)) for part in (seed, seat, tick)))
    drawn = np.empty(seeds.size, dtype=float64)
    _draw_all(seeds.ravel(), seats.ravel(), ticks.ravel(), stream, drawn)
    return drawn.reshape(seeds.shape)


def _words(numbers: ArrayLike) -> NDArray[uint64]:
    if isinstance(numbers, int):
        return np.asarray(numbers & _WORD, dtype=uint64)
    return np.asarray(numbers).astype(uint64)


def _mixed(word: int) -> int:
    word = (word ^ (word >> 30)) * _FIRST & _WORD
    word = (word ^ (word >> 27)) * _SECOND & _WORD
    return word ^ (word >> 31)


@lean_kernel
def draw(seed: int | uint64, seat: int, tick: int, stream: int) -> float:
    """What `uniform` gives for the same four numbers, bit for bit, for other kernels."""
    word = uint64(0)
    for part in (uint64(seed), uint64(seat), uint64(tick), uint64(stream)):
        word = (word ^ part) + uint64(_STEP)
        word = (word ^ (word >> uint64(30))) * uint64(_FIRST)
        word = (word ^ (word >> uint64(27))) * uint64(_SECOND)
        word ^= word >> uint64(31)
    return float(word >> uint64(11)) * _SPACING


@kernel
def _draw_all(
    seeds: NDArray[uint64],
    seats: NDArray[uint64],
    ticks: NDArray[uint64],
    stream: int,
    drawn: NDArray[float64],
) -> None:
    for row in range(drawn.size):
        drawn[row] = draw(seeds[row], seats[row], ticks[row], stream)
