"""Partners are drawn by their bounds; populations take in what ranks well and let early ones go."""

from __future__ import annotations

import numpy as np
import pytest

from galley.evaluation.game_graph import accepted, draw_partners, rank, removal, sucg

PHI = np.array([0.5, 0.3, 0.2])
VISITS = np.array([4, 0, 5])


def test_bounds_solved_by_hand() -> None:
    # sqrt(9) = 3, times c = 0.1 is 0.3: bonuses 0.3/5, 0.3/1, 0.3/6.
    # Bounds 0.56, 0.60, 0.25 sum to 1.41.
    np.testing.assert_allclose(sucg(PHI, VISITS, 0.1), np.array([0.56, 0.60, 0.25]) / 1.41)


def test_without_the_constant_or_before_the_first_visit_the_distribution_stays() -> None:
    np.testing.assert_allclose(sucg(PHI, VISITS, 0.0), PHI)
    np.testing.assert_allclose(sucg(PHI, np.zeros(3, dtype=int), 5.0), PHI)


def test_a_new_strategy_is_drawn_soon() -> None:
    visits = np.array([1000, 1000, 0])
    assert sucg(PHI, visits, 1.0)[2] > 0.95


@pytest.mark.parametrize(
    ("phi", "visits", "constant"),
    [
        (PHI, VISITS[:2], 0.1),
        (PHI, VISITS, -0.1),
        (-PHI, VISITS, 0.1),
        (PHI, -VISITS, 0.1),
        (np.zeros(3), VISITS, 0.1),
        (np.zeros(0), np.zeros(0, dtype=int), 0.1),
    ],
)
def test_what_is_no_distribution_is_refused(phi: np.ndarray, visits: np.ndarray, constant: float) -> None:
    with pytest.raises(ValueError, match="must"):
        sucg(phi, visits, constant)


def test_every_draw_counts_before_the_next() -> None:
    partners, after = draw_partners(PHI, VISITS, 0.4, 6, np.random.default_rng(5))
    generator, seen = np.random.default_rng(5), VISITS.copy()
    for partner in partners:
        assert generator.choice(3, p=sucg(PHI, seen, 0.4)) == partner
        seen[partner] += 1
    assert after.tolist() == seen.tolist()
    assert VISITS.tolist() == [4, 0, 5]
    none, same = draw_partners(PHI, VISITS, 0.4, 0, np.random.default_rng(5))
    assert none.shape == (0,)
    assert same.tolist() == VISITS.tolist()


def test_draws_follow_the_distribution_and_the_constant_evens_them_out() -> None:
    start = np.zeros(3, dtype=int)
    _, plain = draw_partners(PHI, start, 0.0, 4000, np.random.default_rng(1))
    np.testing.assert_allclose(plain / 4000, PHI, atol=0.03)
    _, even = draw_partners(PHI, start, 100.0, 4000, np.random.default_rng(1))
    np.testing.assert_allclose(even / 4000, np.full(3, 1 / 3), atol=0.03)


def test_lower_centrality_ranks_higher_and_ties_share_the_rank() -> None:
    centralities = np.array([0.4, 0.0, 0.4, 1.0, 0.0])
    assert [rank(centralities, one) for one in range(5)] == [3, 1, 3, 5, 1]


def test_the_best_tenth_is_accepted_and_always_the_best_one() -> None:
    centralities = np.arange(25) / 25
    # k = ceil(0.1 * 25) = 3.
    assert [one for one in range(25) if accepted(centralities, one)] == [0, 1, 2]
    assert [one for one in range(25) if accepted(centralities, one, share=0.2)] == [0, 1, 2, 3, 4]
    few = np.array([0.5, 0.0])
    assert not accepted(few, 0)
    assert accepted(few, 1)
    assert accepted(np.array([0.0]), 0)
    assert all(accepted(np.ones(3), one) for one in range(3))
    for share in (0, 1.1):
        with pytest.raises(ValueError, match="share"):
            accepted(few, 0, share)


def test_one_of_the_earliest_ten_leaves_a_population_that_is_too_large() -> None:
    generator = np.random.default_rng(2)
    assert removal(50, generator) is None
    left = [removal(51, generator) for _ in range(500)]
    assert set(left) == set(range(10))
    assert min(left.count(one) for one in range(10)) > 25
    assert removal(4, generator, cap=3, earliest=1) == 0
    assert {removal(3, generator, cap=2) for _ in range(50)} == {0, 1}
    assert {removal(6, generator, cap=5, earliest=2, kept=3) for _ in range(50)} == {3, 4}
    assert removal(4, generator, cap=3, kept=2) == 2
    assert removal(51, np.random.default_rng(9)) == removal(51, np.random.default_rng(9))
    with pytest.raises(ValueError, match="at least 1"):
        removal(51, generator, cap=0)
    with pytest.raises(ValueError, match="kept must be 0 to 2 of 4"):
        removal(4, generator, cap=3, kept=3)
