"""Whom to train with next: hard partners often, new ones soon."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def sucg(
    distribution: NDArray[np.floating], visits: NDArray[np.integer], constant: float
) -> NDArray[np.float64]:
    """Float64 [n]: the sampled upper confidence bounds for the game graph, as probabilities.

    phi-hat(u) = phi(u) + c sqrt(sum of N) / (1 + N(u)), divided by its sum, from the solver's `distribution`
    phi (float [n]), the `visits` N (int [n]) and c = `constant`. With c = 0 it is phi: the ablation without
    SUCG.

    Source: COLE, Eq. 8.

    Raises:
        ValueError: shapes differ, a number is negative, or the distribution sums to 0.
    """
    if distribution.shape != visits.shape or distribution.ndim != 1 or not len(distribution):
        raise ValueError(
            f"distribution and visits must have one shape [n], not {list(distribution.shape)} and "
            f"{list(visits.shape)}"
        )
    if constant < 0 or distribution.min() < 0 or visits.min() < 0 or not distribution.sum() > 0:
        raise ValueError("distribution, visits and constant must not be negative, nor the distribution all 0")
    bounds = distribution + constant * np.sqrt(visits.sum()) / (1.0 + visits)
    return np.asarray(bounds / bounds.sum(), dtype=np.float64)


def draw_partners(
    distribution: NDArray[np.floating],
    visits: NDArray[np.integer],
    constant: float,
    count: int,
    generator: np.random.Generator,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The partners drawn, int64 [count], and the visits after them, int64 [n]; `visits` is not changed.

    Each draw counts as a visit before the next is made.

    Source: COLE, Algorithm 1, line 16 ("updated each time by Eq. 8").

    Raises:
        ValueError: as `sucg`; fewer than 0 partners.
    """
    seen = visits.astype(np.int64)
    drawn = np.empty(count, dtype=np.int64)
    for place in range(count):
        drawn[place] = generator.choice(len(seen), p=sucg(distribution, seen, constant))
        seen[drawn[place]] += 1
    return drawn, seen
