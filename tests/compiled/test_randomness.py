"""Randomness is a function of seed, seat, tick and stream."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from galley.compiled.randomness import uniform

WORDS = st.integers(min_value=0, max_value=2**64 - 1)


@given(st.lists(st.tuples(WORDS, st.integers(0, 1), st.integers(0, 30_000)), min_size=1, max_size=5))
def test_arrays_give_what_single_numbers_give(parts: list[tuple[int, int, int]]) -> None:
    seeds, seats, ticks = (np.array(column, dtype=np.uint64) for column in zip(*parts, strict=True))
    drawn = uniform(seeds, seats, ticks, 3)
    assert drawn.tolist() == [uniform(*part, 3) for part in parts]
    assert ((drawn >= 0) & (drawn < 1)).all()


def test_arrays_are_broadcast() -> None:
    drawn = uniform(7, 1, np.arange(4))
    assert drawn.tolist() == [uniform(7, 1, tick) for tick in range(4)]


def test_numbers_are_even_and_unrelated_between_neighbours() -> None:
    ticks = np.arange(100_000)
    drawn = uniform(5, 0, ticks)
    assert abs(drawn.mean() - 0.5) < 0.004
    assert abs(np.histogram(drawn, bins=10, range=(0, 1))[0] - 10_000).max() < 400
    for other in (
        uniform(5, 1, ticks),
        uniform(6, 0, ticks),
        uniform(5, 0, ticks, 1),
        uniform(5, 0, ticks + 1),
    ):
        assert abs(np.corrcoef(drawn, other)[0, 1]) < 0.012


def test_the_finaliser_is_that_of_splitmix64() -> None:
    # The first output of SplitMix64 seeded with 0 is the finaliser of its increment, as chained here once.
    from galley.compiled.randomness import _mixed

    assert _mixed(0x9E3779B97F4A7C15) == 0xE220A8397B1DCDAF
