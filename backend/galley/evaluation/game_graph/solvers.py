"""The cooperative incompatibility distribution: who is hard to cook with gets more probability."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.evaluation.game_graph.pagerank import unpopularity
from galley.evaluation.game_graph.shapley import exact_shapley, pair_worths, sampled_shapley


def incompatibility(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """Float64 [n], a distribution: from what each strategy is worth, normalised and inverted.

    phi = values / sum, then (1 - phi) / sum of (1 - phi). What the formulas leave open: a single strategy
    gets 1; where the values sum to 0 or less (nobody scores with anybody) all get the same; a strategy that
    is worth more than all together, so that 1 - phi is negative, gets 0 and the rest is divided by its own
    sum.

    Source: COLE, Algorithm 2, lines 12 and 13.
    """
    size = len(values)
    total = values.sum()
    if size == 1 or not total > 0:
        return np.full(size, 1 / size)
    inverted = np.maximum(1 - values / total, 0.0)
    return np.asarray(inverted / inverted.sum())


def graphic_shapley(
    payoffs: NDArray[np.floating],
    permutations: int,
    generator: np.random.Generator,
    weighted: bool = True,
) -> NDArray[np.float64]:
    """Float64 [n], a distribution: the graphic Shapley value solver of COLE-SV on payoffs float [n, n].

    With `permutations` 0 the Shapley values are exact, without sampling. `weighted` False leaves the weighted
    PageRank out (the ablation COLE-SV minus WPG).

    Source: COLE, Algorithm 2 and Sec. 7.4.

    Raises:
        ValueError: `payoffs` are no square, incomplete or negative; fewer than 0 permutations.
    """
    worths = pair_worths(payoffs, unpopularity(payoffs) if weighted else None)
    if permutations == 0:
        return incompatibility(exact_shapley(worths))
    return incompatibility(sampled_shapley(worths, permutations, generator))


def reward_solver(payoffs: NDArray[np.floating], weighted: bool = True) -> NDArray[np.float64]:
    """Float64 [n], a distribution: the reward solver of COLE-R on payoffs float [n, n].

    phi(i) = sum over j of sigma(i) sigma(j) w(i, j), j = i included, then normalised and inverted as above.

    Source: COLE, Eq. 7.

    Raises:
        ValueError: `payoffs` are no square, incomplete or negative.
    """
    return incompatibility(pair_worths(payoffs, unpopularity(payoffs) if weighted else None).sum(axis=1))
