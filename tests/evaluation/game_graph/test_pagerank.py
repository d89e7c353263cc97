"""Weighted PageRank against graphs that were solved by hand, and the cases its formula leaves open."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from galley.evaluation.game_graph import unpopularity, weighted_pagerank


def test_a_star_solved_by_hand() -> None:
    # Payoffs 1 between 0 and either other, 0 between 1 and 2: degrees I = O = 2, 1, 1.
    # From 0: shares 1/2 and 1/2, so weights 1/4 to 1 and 1/4 to 2.
    # From 1: shares 2/3 to 0 and 1/3 to 2, so weights 4/9 and 1/9; from 2 likewise.
    # With y = sigma(0) and x = sigma(1) = sigma(2), d = 17/20:
    #   y = 3/20 + 17/20 * 8/9 x  and  x = 3/20 + 17/20 (y/4 + x/9)
    # The first in the second: x (163/180 - 289/1800) = 291/1600, so x = 291/1192 and y = 299/894.
    x, y = Fraction(291, 1192), Fraction(299, 894)
    d = Fraction(17, 20)
    assert y == 1 - d + d * Fraction(8, 9) * x
    assert x == 1 - d + d * (y / 4 + x / 9)
    star = np.array([[90.0, 1, 1], [1, 40, 0], [1, 0, 0]])
    found = weighted_pagerank(star)
    np.testing.assert_allclose(found, [float(y), float(x), float(x)], atol=1e-8)
    np.testing.assert_allclose(unpopularity(star), [894 / 299, 1192 / 291, 1192 / 291], rtol=1e-7)


def test_two_strategies_pass_all_they_have_to_each_other() -> None:
    # s = 1 - d + d s, so s = 1, whatever the payoff.
    np.testing.assert_allclose(weighted_pagerank(np.array([[0, 35.0], [35.0, 80]])), [1, 1], atol=1e-8)


def test_equal_payoffs_solved_by_hand() -> None:
    # Each of n - 1 partners passes 1/(n-1)^2 of itself: s = 1 - d + d s / (n - 1); for n = 3, s = 0.15/0.575.
    np.testing.assert_allclose(weighted_pagerank(np.full((3, 3), 20.0)), np.full(3, 6 / 23), atol=1e-8)
    np.testing.assert_allclose(unpopularity(np.full((3, 3), 20.0)), np.full(3, 23 / 6), atol=1e-6)


def test_incoming_and_outgoing_payoffs_are_told_apart() -> None:
    # Outgoing sums (rows) 3, 4, 8, incoming (columns) 7, 3, 5. Weights, incoming share times outgoing:
    #   0 -> 1: 3/8 * 4/12 = 1/8    0 -> 2: 5/8 * 8/12 = 5/12
    #   1 -> 0: 7/12 * 3/11 = 7/44  1 -> 2: 5/12 * 8/11 = 10/33
    #   2 -> 0: 7/10 * 3/7 = 3/10   2 -> 1: 3/10 * 4/7 = 6/35
    directed = np.array([[0.0, 1, 2], [1, 0, 3], [6, 2, 0]])
    weights = np.array([[0, 1 / 8, 5 / 12], [7 / 44, 0, 10 / 33], [3 / 10, 6 / 35, 0]])
    wanted = np.linalg.solve(np.eye(3) - 0.85 * weights.T, np.full(3, 0.15))
    np.testing.assert_allclose(weighted_pagerank(directed), wanted, atol=1e-8)


def test_nothing_is_divided_by_zero() -> None:
    np.testing.assert_allclose(weighted_pagerank(np.zeros((3, 3))), np.full(3, 6 / 23), atol=1e-8)
    np.testing.assert_allclose(weighted_pagerank(np.array([[50.0]])), [0.15], atol=1e-12)
    np.testing.assert_allclose(unpopularity(np.array([[50.0]])), [1 / 0.15], atol=1e-9)
    # Only 0 and 1 score together: 0 passes all to 1 and back, 2 half of each share (1/4) to either.
    lonely = np.zeros((3, 3))
    lonely[0, 1] = lonely[1, 0] = 60
    pair = (0.15 + 0.85 * 0.15 / 4) / 0.15
    np.testing.assert_allclose(weighted_pagerank(lonely), [pair, pair, 0.15], atol=1e-7)


def test_damping_must_be_a_share() -> None:
    np.testing.assert_allclose(weighted_pagerank(np.ones((4, 4)), damping=0.0), np.ones(4))
    with pytest.raises(ValueError, match="damping"):
        weighted_pagerank(np.ones((2, 2)), damping=1.0)


@given(arrays.arrays(np.float64, st.integers(1, 8).map(lambda n: (n, n)), elements=st.floats(0, 250)))
def test_the_values_found_solve_the_equation(payoffs: np.ndarray) -> None:
    payoffs = np.round(payoffs + payoffs.T)
    found = weighted_pagerank(payoffs)
    assert np.isfinite(unpopularity(payoffs)).all()
    size = len(payoffs)
    degrees = payoffs.sum(axis=0) - np.diagonal(payoffs)
    for u in range(size):
        total = 0.0
        for v in range(size):
            others = [p for p in range(size) if p != v]
            if v != u and sum(degrees[p] for p in others):
                total += found[v] * (degrees[u] / sum(degrees[p] for p in others)) ** 2
            elif v != u:
                total += found[v] / (size - 1) ** 2
        assert found[u] == pytest.approx(0.15 + 0.85 * total, abs=1e-8)
