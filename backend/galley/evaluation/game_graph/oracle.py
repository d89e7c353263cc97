"""Which new strategies a population takes in, and which it lets go."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

CAP: Final = 50
EARLIEST: Final = 10


def rank(centralities: NDArray[np.floating], strategy: int) -> int:
    """1 + how many strategies are preferred more than `strategy`: lower centrality, higher rank, ties share.

    Source: COLE, Eq. 5.
    """
    return 1 + int(np.count_nonzero(centralities < centralities[strategy]))


def accepted(centralities: NDArray[np.floating], strategy: int, share: float = 0.1) -> bool:
    """Whether the preference centrality of `strategy` ranks among the best `share` of all (at least one).

    `centralities` float [n] are those of the population with the new strategy in it; the threshold is
    k = ceil(share n).

    Source: COLE, Eq. 5; the share of 10% is that of a public re-implementation, which gives a generation up
    to three tries.

    Raises:
        ValueError: `share` is not above 0 and at most 1.
    """
    if not 0 < share <= 1:
        raise ValueError(f"share must be above 0 and at most 1, not {share}")
    return rank(centralities, strategy) <= math.ceil(share * len(centralities))


def removal(
    size: int, generator: np.random.Generator, cap: int = CAP, earliest: int = EARLIEST, kept: int = 0
) -> int | None:
    """The number of the strategy that a population of `size` lets go: one of the earliest; None up to `cap`.

    Never the newest, and none of the first `kept`.

    Source: COLE, App. C; `kept` is ours.

    Raises:
        ValueError: `cap` or `earliest` are below 1; no strategy may go.
    """
    if cap < 1 or earliest < 1:
        raise ValueError(f"cap and earliest must be at least 1, not {cap} and {earliest}")
    if size <= cap:
        return None
    if not 0 <= kept < size - 1:
        raise ValueError(f"kept must be 0 to {size - 2} of {size} strategies, not {kept}")
    return kept + int(generator.integers(min(earliest, size - 1 - kept)))
