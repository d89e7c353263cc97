"""Preference graphs and centralities of small populations, found by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from galley.evaluation.game_graph import (
    centrality_matrix,
    newest_centralities,
    preference_centrality,
    preference_edges,
)

NAN = float("nan")

INCOMPATIBLE = np.array(
    [
        # 0    1    2    3
        [10.0, 60.0, 30.0, 40.0],
        [60.0, 20.0, 50.0, 20.0],
        [30.0, 50.0, 90.0, 10.0],
        [40.0, 20.0, 10.0, 99.0],
    ]
)
"""As in Fig. 1 (a): 0 and 1 prefer each other for good; 2 and 3, best with themselves, nobody prefers."""

COMPATIBLE = np.array(
    [
        [5.0, 10.0, 20.0, 30.0],
        [10.0, 99.0, 25.0, 35.0],
        [20.0, 25.0, 5.0, 40.0],
        [30.0, 35.0, 40.0, 5.0],
    ]
)
"""As in Fig. 1 (b): whoever is newest is the best partner of all others."""


def test_everyone_points_at_the_best_partner_but_never_at_itself() -> None:
    # Best of row 0 without the diagonal: 60 at 1. Row 1: 60 at 0. Row 2: 50 at 1. Row 3: 40 at 0.
    assert np.argwhere(preference_edges(INCOMPATIBLE)).tolist() == [[0, 1], [1, 0], [2, 1], [3, 0]]
    # So in-degrees 2, 2, 0, 0 of 3 others.
    np.testing.assert_allclose(preference_centrality(INCOMPATIBLE), [1 / 3, 1 / 3, 1, 1])


def test_the_matrix_tells_every_earlier_population() -> None:
    # {0}: alone. {0, 1}: only each other. {0, 1, 2}: 0 -> 1, 1 -> 0, 2 -> 1, in-degrees 1, 2, 0 of 2.
    np.testing.assert_allclose(
        centrality_matrix(INCOMPATIBLE),
        [[0, NAN, NAN, NAN], [0, 0, NAN, NAN], [1 / 2, 0, 1, NAN], [1 / 3, 1 / 3, 1, 1]],
    )
    assert newest_centralities(centrality_matrix(INCOMPATIBLE)).tolist() == [0, 1, 1]
    # 2 -> 1 in {0, 1, 2} (25 against 20) and 0, 1 -> 2; with 3 all point at 3 and 3 at 2.
    np.testing.assert_allclose(
        centrality_matrix(COMPATIBLE),
        [[0, NAN, NAN, NAN], [0, 0, NAN, NAN], [1, 1 / 2, 0, NAN], [1, 1, 2 / 3, 0]],
    )
    assert newest_centralities(centrality_matrix(COMPATIBLE)).tolist() == [0, 0, 0]


def test_every_tied_best_partner_gets_an_edge() -> None:
    payoffs = np.array([[0.0, 50.0, 50.0], [50.0, 80.0, 20.0], [50.0, 20.0, 0.0]])
    # 0 likes 1 and 2 alike; 1 -> 0; 2 -> 0: in-degrees 2, 1, 1 of 2 others.
    assert np.argwhere(preference_edges(payoffs)).tolist() == [[0, 1], [0, 2], [1, 0], [2, 0]]
    np.testing.assert_allclose(preference_centrality(payoffs), [0, 1 / 2, 1 / 2])


def test_equal_means_of_unequal_sums_are_ties_and_near_ones_are_not() -> None:
    thirds = np.array([[0, 0.1 + 0.2, 0.3], [0.3, 0, 0], [0.3, 0, 0]])
    assert thirds[0, 1] != thirds[0, 2]
    assert preference_edges(thirds)[0].tolist() == [False, True, True]
    thirds[0, 1] = 0.3 + 1e-6
    assert preference_edges(thirds)[0].tolist() == [False, True, False]


def test_nobody_who_ever_scores_means_nobody_is_preferred_less() -> None:
    assert preference_edges(np.zeros((3, 3))).sum() == 6
    assert preference_centrality(np.zeros((3, 3))).tolist() == [0, 0, 0]
    assert preference_centrality(np.array([[7.0]])).tolist() == [0]
    assert centrality_matrix(np.array([[7.0]])).tolist() == [[0]]
    assert newest_centralities(np.zeros((1, 1))).shape == (0,)


def test_another_centrality_can_be_plugged_in() -> None:
    def mutual(edges: np.ndarray) -> np.ndarray:
        return (edges & edges.T).any(axis=0).astype(float)

    assert preference_centrality(INCOMPATIBLE, mutual).tolist() == [0, 0, 1, 1]
    assert newest_centralities(centrality_matrix(COMPATIBLE, mutual)).tolist() == [0, 0, 0]
    with pytest.raises(ValueError, match="from 0 to 1"):
        preference_centrality(INCOMPATIBLE, lambda edges: edges.sum(axis=0).astype(float))
    with pytest.raises(ValueError, match="4 numbers"):
        preference_centrality(INCOMPATIBLE, lambda edges: np.zeros(3))


@given(
    arrays.arrays(
        np.float64, st.integers(2, 6).map(lambda n: (n, n)), elements=st.sampled_from([0.0, 20.0, 40.0])
    ),
    st.randoms(use_true_random=False),
)
def test_results_do_not_depend_on_the_order_of_strategies(payoffs: np.ndarray, random: object) -> None:
    payoffs = payoffs + payoffs.T
    order = np.arange(len(payoffs))
    random.shuffle(order)  # type: ignore[attr-defined]
    moved = preference_centrality(payoffs[np.ix_(order, order)])
    np.testing.assert_allclose(moved, preference_centrality(payoffs)[order])
