"""Who prefers whom: the preference graph of a population, and how preferred each strategy is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from galley.evaluation.game_graph.payoff_table import require_payoffs

TIE: Final = 1e-9
"""Payoffs whose distance is below this share of the larger are equal: means of the same scores in another
order differ in the last digits."""

Centrality = Callable[[NDArray[np.bool_]], NDArray[np.floating]]
"""From a preference graph, bool [n, n] with n from 2 up, to how preferred each node is, [n] from 0 to 1."""


def preference_edges(payoffs: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Bool [n, n]: whether strategy i (row) prefers partner j (column) to all others; never itself.

    Every one of several equally good partners gets an edge, so nothing depends on the order of strategies. A
    single strategy has no edge.

    Source: COLE, Sec. 4.1, preference graphic-form game.

    Raises:
        ValueError: `payoffs` are no square, incomplete or negative.
    """
    others = require_payoffs(payoffs).copy()
    np.fill_diagonal(others, -np.inf)
    best = others.max(axis=1, keepdims=True)
    edges: NDArray[np.bool_] = others >= best - TIE * np.maximum(best, 0)
    np.fill_diagonal(edges, False)
    return edges


def in_degree(edges: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Float64 [n], 0 to 1: the share of the other nodes that have an edge to each node.

    Source: COLE, Eq. 12.
    """
    return np.asarray(edges.sum(axis=0) / (len(edges) - 1), dtype=np.float64)


def preference_centrality(
    payoffs: NDArray[np.floating], centrality: Centrality = in_degree
) -> NDArray[np.float64]:
    """Float64 [n]: eta = 1 - how preferred each strategy is; 0 is preferred by all others, 1 by none.

    A single strategy has 0: there is no other that does not prefer it.

    Source: COLE, Definition 4.2 and Eq. 12.

    Raises:
        ValueError: `payoffs` are no square, incomplete or negative; `centrality` leaves 0 to 1.
    """
    edges = preference_edges(payoffs)
    if len(edges) == 1:
        return np.zeros(1)
    preferred = np.asarray(centrality(edges), dtype=np.float64)
    if preferred.shape != (len(edges),) or not (preferred >= 0).all() or not (preferred <= 1).all():
        raise ValueError(f"a centrality must give {len(edges)} numbers from 0 to 1, not {preferred}")
    return 1 - preferred


def centrality_matrix(
    payoffs: NDArray[np.floating], centrality: Centrality = in_degree
) -> NDArray[np.float64]:
    """Float64 [n, n]: in row i the preference centrality of strategies 0 to i among themselves, NaN after.

    Row i belongs to the sub-preference graph of the moment when strategy i was the newest.

    Source: COLE, Sec. 4.1 (sub-preference graphs), Fig. 1, 2b and 10.

    Raises:
        ValueError: as `preference_centrality`.
    """
    complete = require_payoffs(payoffs)
    matrix = np.full(complete.shape, np.nan)
    for newest in range(len(complete)):
        among = slice(0, newest + 1)
        matrix[newest, among] = preference_centrality(complete[among, among], centrality)
    return matrix


def newest_centralities(matrix: NDArray[np.floating]) -> NDArray[np.float64]:
    """Float64 [n - 1]: from a centrality matrix, the centrality of each strategy when it was the newest.

    The first strategy, which had no partner, is left out. 0 throughout means no cooperative incompatibility
    in learning; the mean compares populations.

    Source: COLE, Sec. 4.3.
    """
    return np.asarray(np.diagonal(matrix)[1:], dtype=np.float64).copy()
