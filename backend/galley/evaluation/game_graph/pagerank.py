"""How popular a strategy is in the game graph of its population."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from galley.evaluation.game_graph.payoff_table import require_payoffs

DAMPING: Final = 0.85
CONVERGED: Final = 1e-9
"""The iteration ends when no value changes by more than this."""


def weighted_pagerank(payoffs: NDArray[np.floating], damping: float = DAMPING) -> NDArray[np.float64]:
    """Float64 [n]: sigma-hat, the weighted PageRank of each strategy on the complete game graph.

    sigma-hat(u) = (1 - d) + d * sum over v != u of sigma-hat(v) * I_u / sum I_p * O_u / sum O_p, the sums
    over all p != v; I and O are the sums of incoming and outgoing payoffs, self-loops left out. Where all
    strategies but v have payoffs of 0, v passes equal shares to them, as it does in the limit of equal
    payoffs; so nothing is divided by 0. A single strategy has 1 - d.

    Source: COLE, Eq. 6; Xing and Ghorbani 2004.

    Raises:
        ValueError: `payoffs` are no square, incomplete or negative; `damping` is not from 0 to below 1.
    """
    if not 0 <= damping < 1:
        raise ValueError(f"damping must be from 0 to below 1, not {damping}")
    between = require_payoffs(payoffs).copy()
    np.fill_diagonal(between, 0)
    shares = _shares(between.sum(axis=0)) * _shares(between.sum(axis=1))
    ranks = np.ones(len(between))
    while True:  # a contraction: the shares of each v sum to at most 1, and d is below 1
        following = (1 - damping) + damping * (ranks @ shares)
        if np.abs(following - ranks).max() <= CONVERGED:
            return following
        ranks = following


def unpopularity(payoffs: NDArray[np.floating], damping: float = DAMPING) -> NDArray[np.float64]:
    """Float64 [n]: sigma = 1 / sigma-hat, how badly each strategy does in the game graph.

    Source: COLE, Sec. 5.1, below Eq. 6.

    Raises:
        ValueError: as `weighted_pagerank`.
    """
    return 1 / weighted_pagerank(payoffs, damping)


def _shares(degrees: NDArray[np.float64]) -> NDArray[np.float64]:
    """Float64 [n, n]: in row v the share of each u != v in the degrees of all but v; 0 on the diagonal."""
    shares = np.tile(degrees, (len(degrees), 1))
    np.fill_diagonal(shares, 0)
    totals = shares.sum(axis=1, keepdims=True)
    nothing = totals[:, 0] == 0
    shares[nothing] = 1.0
    np.fill_diagonal(shares, 0)
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    return shares
