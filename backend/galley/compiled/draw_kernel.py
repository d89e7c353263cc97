"""The random numbers of `galley.compiled.randomness`, compiled."""

from __future__ import annotations

from numpy import uint64

from galley.compiled.kernels import lean_kernel

_STEP = uint64(0x9E3779B97F4A7C15)
_FIRST = uint64(0xBF58476D1CE4E5B9)
_SECOND = uint64(0x94D049BB133111EB)


@lean_kernel
def _mixed(word: uint64) -> uint64:
    word = (word ^ (word >> uint64(30))) * _FIRST
    word = (word ^ (word >> uint64(27))) * _SECOND
    return word ^ (word >> uint64(31))


@lean_kernel
def draw(seed: int | uint64, seat: int, tick: int, stream: int) -> float:
    """What `galley.compiled.randomness.uniform` gives for the same four numbers, bit for bit."""
    word = _mixed(uint64(seed) + _STEP)
    word = _mixed((word ^ uint64(seat)) + _STEP)
    word = _mixed((word ^ uint64(tick)) + _STEP)
    word = _mixed((word ^ uint64(stream)) + _STEP)
    return float(word >> uint64(11)) * 2.0**-53
