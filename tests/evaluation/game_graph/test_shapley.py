"""Shapley values against their definition, over every permutation and every subset."""

from __future__ import annotations

from itertools import combinations, permutations
from math import comb, factorial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from galley.evaluation.game_graph import (
    coalition_value,
    exact_shapley,
    graphic_shapley,
    incompatibility,
    pair_worths,
    reward_solver,
    sampled_shapley,
    unpopularity,
)
from galley.evaluation.game_graph.shapley import mean_marginals

worths_of = arrays.arrays(
    np.float64, st.integers(1, 7).map(lambda n: (n, n)), elements=st.integers(0, 240).map(float)
)


def by_subsets(worths: np.ndarray) -> np.ndarray:
    """The Shapley values from every coalition without i, weighted by |S|! (n - |S| - 1)! / n!."""
    size = len(worths)
    values = np.zeros(size)
    for i in range(size):
        others = [j for j in range(size) if j != i]
        for count in range(size):
            for chosen in combinations(others, count):
                gain = mean_of_pairs(worths, (*chosen, i)) - mean_of_pairs(worths, chosen)
                values[i] += gain / (size * comb(size - 1, count))
    return values


def mean_of_pairs(worths: np.ndarray, members: tuple[int, ...]) -> float:
    total = 0.0
    for i in members:
        for j in members:
            total += worths[i, j]
    return total / len(members) ** 2 if members else 0.0


def population(size: int, seed: int) -> np.ndarray:
    scores = np.random.default_rng(seed).uniform(0, 200, (size, size))
    return (scores + scores.T) / 2


def test_a_coalition_is_worth_the_mean_over_all_pairs_of_its_members() -> None:
    payoffs = np.array([[80.0, 20, 40], [20, 100, 60], [40, 60, 0]])
    assert coalition_value(pair_worths(payoffs), []) == 0
    assert coalition_value(pair_worths(payoffs), [1]) == 100
    assert coalition_value(pair_worths(payoffs), [0, 1]) == (80 + 2 * 20 + 100) / 4
    # With sigma = 1, 2, 3: 1*1*80, twice 1*3*40 and 3*3*0, over 4.
    worths = pair_worths(payoffs, np.array([1.0, 2.0, 3.0]))
    assert coalition_value(worths, [0, 2]) == (80 + 2 * 120 + 0) / 4
    with pytest.raises(ValueError, match=r"sigma must have shape \[3\]"):
        pair_worths(payoffs, np.ones(2))


def test_two_strategies_solved_by_hand() -> None:
    # v({0}) = 80, v({1}) = 20, v({0, 1}) = (80 + 2 * 10 + 20) / 4 = 30.
    # 0 first adds 80, 0 second adds 30 - 20: 45. 1 first adds 20, 1 second adds 30 - 80: -15. Together 30.
    worths = np.array([[80.0, 10], [10, 20]])
    np.testing.assert_allclose(exact_shapley(worths), [45, -15])
    np.testing.assert_allclose(mean_marginals(worths, np.array([[0, 1], [1, 0]])), [45, -15])


@pytest.mark.parametrize("size", range(1, 8))
def test_every_way_to_the_values_agrees_with_the_definition(size: int) -> None:
    payoffs = population(size, seed=size)
    for worths in (pair_worths(payoffs), pair_worths(payoffs, unpopularity(payoffs))):
        wanted = by_subsets(worths)
        orders = np.array(list(permutations(range(size))))
        assert len(orders) == factorial(size)
        np.testing.assert_allclose(mean_marginals(worths, orders), wanted, rtol=1e-9)
        np.testing.assert_allclose(exact_shapley(worths), wanted, rtol=1e-9)


@given(worths_of)
def test_the_closed_form_holds_for_payoffs_that_differ_by_seat_too(worths: np.ndarray) -> None:
    np.testing.assert_allclose(exact_shapley(worths), by_subsets(worths), atol=1e-9)


@given(worths_of, st.integers(1, 20), st.integers(0, 1000))
def test_the_values_share_out_what_all_are_worth_together(worths: np.ndarray, count: int, seed: int) -> None:
    everyone = coalition_value(worths, range(len(worths)))
    sampled = sampled_shapley(worths, count, np.random.default_rng(seed))
    assert sampled.sum() == pytest.approx(everyone, abs=1e-9)
    assert exact_shapley(worths).sum() == pytest.approx(everyone, abs=1e-9)


def test_equal_strategies_get_equal_values() -> None:
    payoffs = population(6, seed=3)
    payoffs[5], payoffs[:, 5] = payoffs[2], payoffs[:, 2]
    payoffs[5, 5] = payoffs[2, 5] = payoffs[5, 2] = payoffs[2, 2]
    values = exact_shapley(pair_worths(payoffs, unpopularity(payoffs)))
    assert values[2] == pytest.approx(values[5])


def test_more_permutations_come_closer_to_the_exact_values() -> None:
    payoffs = population(50, seed=1)
    worths = pair_worths(payoffs, unpopularity(payoffs))
    exact = exact_shapley(worths)
    scale = np.abs(exact).mean()
    few, many = (
        np.abs(sampled_shapley(worths, count, np.random.default_rng(2)) - exact).mean() / scale
        for count in (100, 10_000)
    )
    assert many < 0.1 < few
    # A hundred times the permutations, a tenth of the error, give or take half of it.
    assert few / many == pytest.approx(10, rel=0.5)


def test_the_same_generator_draws_the_same_permutations() -> None:
    worths = pair_worths(population(9, seed=4))
    one, again, other = (sampled_shapley(worths, 30, np.random.default_rng(seed)) for seed in (7, 7, 8))
    assert (one == again).all()
    assert (one != other).any()
    with pytest.raises(ValueError, match="at least one permutation"):
        sampled_shapley(worths, 0, np.random.default_rng(1))


def test_distributions_are_normalised_and_inverted() -> None:
    # phi = 1/4, 3/4; 1 - phi = 3/4, 1/4, which sum to 1.
    np.testing.assert_allclose(incompatibility(np.array([10.0, 30.0])), [0.75, 0.25])
    # phi = 1/2, 1/3, 1/6; 1 - phi = 3/6, 4/6, 5/6, divided by 2.
    np.testing.assert_allclose(incompatibility(np.array([3.0, 2.0, 1.0])), [3 / 12, 4 / 12, 5 / 12])
    # phi = 3/2, -1/2; 1 - phi = -1/2, 3/2: the first cannot be a probability.
    np.testing.assert_allclose(incompatibility(np.array([45.0, -15.0])), [0, 1])
    assert incompatibility(np.array([5.0])).tolist() == [1]
    assert incompatibility(np.array([0.0])).tolist() == [1]
    assert incompatibility(np.zeros(4)).tolist() == [0.25] * 4


def test_the_solver_is_the_formulas_one_after_the_other() -> None:
    payoffs = population(5, seed=6)
    sigma = unpopularity(payoffs)
    weighted = np.array([[sigma[i] * sigma[j] * payoffs[i, j] for j in range(5)] for i in range(5)])
    values = by_subsets(weighted)
    share = values / values.sum()
    assert (share < 1).all()
    wanted = (1 - share) / (1 - share).sum()
    generator = np.random.default_rng(1)
    np.testing.assert_allclose(graphic_shapley(payoffs, 0, generator), wanted)
    sampled = graphic_shapley(payoffs, 50_000, generator)
    np.testing.assert_allclose(sampled, wanted, rtol=0.02)
    assert (sampled != wanted).any()
    plain = by_subsets(payoffs) / by_subsets(payoffs).sum()
    assert (plain < 1).all()
    np.testing.assert_allclose(graphic_shapley(payoffs, 0, generator, weighted=False), (1 - plain) / 4)


def test_who_fails_with_others_is_trained_with_most() -> None:
    payoffs = np.full((4, 4), 100.0)
    payoffs[2, :] = payoffs[:, 2] = 10.0
    for weighted in (True, False):
        for found in (
            graphic_shapley(payoffs, 0, np.random.default_rng(1), weighted),
            reward_solver(payoffs, weighted),
        ):
            assert found.argmax() == 2
            assert found.sum() == pytest.approx(1)
            assert found[0] == pytest.approx(found[1]) == pytest.approx(found[3])


def test_the_reward_solver_solved_by_hand() -> None:
    # Two strategies have sigma = 1. phi = 80 + 10, 10 + 20 = 90, 30; over 120: 3/4, 1/4; inverted 1/4, 3/4.
    np.testing.assert_allclose(reward_solver(np.array([[80.0, 10], [10, 20]])), [1 / 4, 3 / 4], atol=1e-7)
    # The star of the PageRank test has sigma = 894/299, 1192/291, 1192/291.
    a, b = 894 / 299, 1192 / 291
    phi = np.array([a * a * 90 + 2 * a * b, a * b + b * b * 40, a * b])
    wanted = (1 - phi / phi.sum()) / 2
    np.testing.assert_allclose(
        reward_solver(np.array([[90.0, 1, 1], [1, 40, 0], [1, 0, 0]])), wanted, atol=1e-7
    )


def test_populations_without_scores_are_trained_with_evenly() -> None:
    generator = np.random.default_rng(1)
    for found in (graphic_shapley(np.zeros((3, 3)), 10, generator), reward_solver(np.zeros((3, 3)))):
        np.testing.assert_allclose(found, [1 / 3] * 3)
    for alone in (np.array([[0.0]]), np.array([[120.0]])):
        assert graphic_shapley(alone, 10, generator).tolist() == reward_solver(alone).tolist() == [1]
