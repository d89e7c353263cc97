from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise, permutations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.study.visit.counterbalance import (
    Turn,
    bits,
    in_blocks,
    latin_square,
    orders,
    permutation_of,
    permutations_count,
    picks,
    sequences,
    spread,
    together,
)

DRAW = np.random.default_rng(0)
TAG = (3, 0, 1, 2)


@pytest.mark.parametrize("size", range(1, 13))
def test_every_row_has_each_thing_once_and_every_place_each_thing_equally_often(size: int) -> None:
    rows = latin_square(size)
    assert all(sorted(row) == list(range(size)) for row in rows)
    for place in range(size):
        counts = Counter(row[place] for row in rows)
        assert set(counts.values()) == {len(rows) // size}


@pytest.mark.parametrize("size", range(2, 13))
def test_every_thing_follows_every_other_equally_often(size: int) -> None:
    """Williams (1949): balanced for first-order carry-over, odd sizes in twice as many rows."""
    rows = latin_square(size)
    assert len(rows) == size * (1 + size % 2)
    follows = Counter(pair for row in rows for pair in pairwise(row))
    assert len(follows) == size * (size - 1)
    assert len(set(follows.values())) == 1


@given(seed=st.integers(0, 2**63 - 1), size=st.integers(1, 12), blocks=st.integers(1, 5))
def test_every_block_holds_every_treatment_once(seed: int, size: int, blocks: int) -> None:
    given_out = [in_blocks(seed, TAG, number, size) for number in range(size * blocks)]
    for block in range(blocks):
        assert sorted(given_out[block * size : (block + 1) * size]) == list(range(size))


def test_blocks_are_shuffled_each_on_its_own() -> None:
    first = Counter(in_blocks(7, TAG, 4 * block, 4) for block in range(400))
    assert all(abs(count - 100) < 40 for count in first.values())
    assert [in_blocks(7, TAG, n, 4) for n in range(40)] != [
        in_blocks(7, (3, 0, 1, 3), n, 4) for n in range(40)
    ]


def test_permutations_are_all_of_them_once() -> None:
    assert {permutation_of(n, 4) for n in range(24)} == set(permutations(range(4)))
    assert {permutation_of(n, 5, 2) for n in range(20)} == set(permutations(range(5), 2))
    assert (permutations_count(4), permutations_count(5, 2)) == (24, 20)


def test_full_counterbalancing_gives_out_every_sequence_of_orders() -> None:
    count = sequences("full", 3, 2)
    assert count == 36
    seen = {orders("full", 3, 2, DRAW, Turn(1, TAG, number)) for number in range(count)}
    assert len(seen) == 36
    seats = {bits("full", 3, DRAW, Turn(1, TAG, number)) for number in range(8)}
    assert len(seats) == 8


def test_latin_squares_give_every_unit_the_next_row() -> None:
    rows = latin_square(4)
    for number in range(8):
        inside = orders("latin_square", 4, 3, DRAW, Turn(1, TAG, number))
        first = rows.index(inside[0])
        assert inside == tuple(rows[(first + unit) % 4] for unit in range(3))
    assert {orders("latin_square", 4, 1, DRAW, Turn(1, TAG, number))[0] for number in range(4)} == set(rows)


def test_seats_by_latin_square_take_turns_from_either() -> None:
    assert {bits("latin_square", 4, DRAW, Turn(1, TAG, number)) for number in range(2)} == {
        (0, 1, 0, 1),
        (1, 0, 1, 0),
    }
    assert bits("fixed", 3, DRAW, Turn(1, TAG, 5)) == (0, 1, 0)


def test_every_hat_is_equally_often_in_every_role() -> None:
    rows = [picks("latin_square", 7, 3, DRAW, Turn(1, TAG, number)) for number in range(14)]
    for role in range(3):
        assert set(Counter(row[role] for row in rows).values()) == {2}
    everything = [picks("full", 4, 2, DRAW, Turn(1, TAG, number)) for number in range(12)]
    assert set(everything) == set(permutations(range(4), 2))
    assert picks("fixed", 7, 3, DRAW, Turn(1, TAG, 9)) == (0, 1, 2)


@pytest.mark.parametrize("mode", ["fixed", "random", "latin_square", "full"])
def test_places_are_shared_out_evenly(mode: str) -> None:
    for number in range(12):
        laid = spread(mode, 3, 7, DRAW, Turn(1, TAG, number))  # type: ignore[arg-type]
        counts = Counter(laid)
        assert sorted(counts.values()) == [2, 2, 3]


def test_every_thing_comes_to_every_place_equally_often() -> None:
    for mode, size in (("latin_square", 3), ("full", 6)):
        laid = [spread(mode, 3, 3, DRAW, Turn(1, TAG, number)) for number in range(size)]  # type: ignore[arg-type]
        for place in range(3):
            assert set(Counter(one[place] for one in laid).values()) == {size // 3}


@given(
    seed=st.integers(0, 2**63 - 1),
    sizes=st.lists(st.integers(1, 6), min_size=1, max_size=4),
    block=st.integers(0, 3),
)
def test_orders_counted_together_give_every_combination_once_in_a_block(
    seed: int, sizes: list[int], block: int
) -> None:
    whole, run = math.prod(sizes), math.lcm(*sizes)
    given_out = [together(seed, TAG, block * whole + n, sizes) for n in range(whole)]
    assert sorted(given_out) == list(product(*map(range, sizes)))
    for begin in range(0, whole, run):
        for place, size in enumerate(sizes):
            counts = Counter(one[place] for one in given_out[begin : begin + run])
            assert counts == dict.fromkeys(range(size), run // size), "even in every run"


def test_blocks_of_combinations_are_shuffled_each_on_its_own() -> None:
    sizes = [2, 2, 3]
    blocks = {tuple(together(5, TAG, 12 * block + n, sizes) for n in range(12)) for block in range(30)}
    assert len(blocks) > 10
    first = Counter(together(5, TAG, 12 * block, sizes) for block in range(1200))
    assert all(60 < first[one] < 140 for one in product(range(2), range(2), range(3)))
