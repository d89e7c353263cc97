"""What each strategy adds to coalitions of its population."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from galley.compiled.kernels import kernel
from galley.evaluation.game_graph.payoff_table import require_payoffs


def pair_worths(
    payoffs: NDArray[np.floating], sigma: NDArray[np.floating] | None = None
) -> NDArray[np.float64]:
    """Float64 [n, n]: sigma(i) sigma(j) w(i, j); without `sigma` (float [n]) the payoffs w themselves.

    The latter is the ablation without weighted PageRank.

    Source: COLE, Sec. 5.1 (characteristic function) and 7.4.

    Raises:
        ValueError: `payoffs` are no square, incomplete or negative; `sigma` has another length.
    """
    complete = require_payoffs(payoffs)
    if sigma is None:
        return complete.copy()
    if sigma.shape != (len(complete),):
        raise ValueError(f"sigma must have shape [{len(complete)}], not {list(sigma.shape)}")
    return complete * np.outer(sigma, sigma)


def coalition_value(worths: NDArray[np.floating], members: Sequence[int]) -> float:
    """v(C): the mean of the worths (float [n, n]) over all |C|^2 ordered pairs of members, 0 for nobody.

    Pairs of a member with itself count, as both of a pair are drawn independently (and as the double sum of
    the ablation's formula has them).

    Source: COLE, Sec. 5.1 and 7.4.
    """
    chosen = list(members)
    return float(worths[np.ix_(chosen, chosen)].mean()) if chosen else 0.0


def sampled_shapley(
    worths: NDArray[np.float64], permutations: int, generator: np.random.Generator
) -> NDArray[np.float64]:
    """Float64 [n]: the Shapley values of `coalition_value`, estimated from permutations drawn uniformly.

    They sum to the value of the whole population whatever is drawn.

    Source: COLE, Algorithm 2, lines 2 to 11; Castro, Gómez and Tejada 2009.

    Raises:
        ValueError: there is no permutation to draw.
    """
    if permutations < 1:
        raise ValueError(f"at least one permutation must be drawn, not {permutations}")
    orders = np.tile(np.arange(len(worths)), (permutations, 1))
    return mean_marginals(worths, generator.permuted(orders, axis=1))


def mean_marginals(worths: NDArray[np.float64], orders: NDArray[np.int64]) -> NDArray[np.float64]:
    """Float64 [n]: what each strategy adds to those before it, the mean over `orders` int64 [P, n].

    Over all n! orders this is the Shapley value by definition.

    Source: COLE, Eq. 2.
    """
    totals = np.zeros(len(worths))
    _add_marginals(np.ascontiguousarray(worths), np.ascontiguousarray(orders), totals)
    return totals / len(orders)


def exact_shapley(worths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Float64 [n]: the Shapley values of `coalition_value` without sampling, in O(n^2) for any n.

    A coalition's value is a sum over pairs divided by its size squared. The predecessors of i, given that
    they are k, are any k of the others with the same probability, so each pair of others is among them with
    probability k (k - 1) / ((n - 1) (n - 2)) and each single other with k / (n - 1). What i adds is averaged
    over k = 0 .. n - 1.

    Source: Eq. 2 of COLE; the closed form is our own consequence of it.
    """
    size = len(worths)
    own = np.diagonal(worths)
    crossing = worths.sum(axis=0) + worths.sum(axis=1) - 2 * own
    others_own = own.sum() - own
    others_pairs = worths.sum() - own - crossing - others_own
    values = own / size
    for before in range(1, size):
        single = before / (size - 1)
        pair = single * (before - 1) / max(size - 2, 1)
        without = single * others_own + pair * others_pairs
        together = without + own + single * crossing
        values = values + (together / (before + 1) ** 2 - without / before**2) / size
    return np.asarray(values)


@kernel
def _add_marginals(
    worths: NDArray[np.float64], orders: NDArray[np.int64], totals: NDArray[np.float64]
) -> None:
    """Adds to `totals` [n] what each strategy adds in each order, keeping the growing sum over pairs."""
    size = len(worths)
    for order in orders:
        pairs = 0.0
        value = 0.0
        for place in range(size):
            newcomer = order[place]
            pairs += worths[newcomer, newcomer]
            for earlier in order[:place]:
                pairs += worths[newcomer, earlier] + worths[earlier, newcomer]
            following = pairs / ((place + 1) * (place + 1))
            totals[newcomer] += following - value
            value = following
