"""From the logits of networks to actions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def choose(
    logits: NDArray[np.float32],
    barred: NDArray[np.bool_],
    draws: NDArray[np.float64] | None,
) -> NDArray[np.int64]:
    """One action per row, int64 [B], from logits float32 [B, 6].

    Actions barred (bool [B, 6]) get probability 0, unless that would leave a row with none. With draws
    (float64 [B] in [0, 1)) the action is sampled from the softmax by inversion; without, the most probable is
    taken, the first of equals.
    """
    allowed = ~barred
    allowed[~allowed.any(axis=1)] = True
    free = np.where(allowed, logits.astype(np.float64), -np.inf)
    if draws is None:
        best: NDArray[np.int64] = free.argmax(axis=1)
        return best
    weights = np.exp(free - free.max(axis=1, keepdims=True))
    reached = weights.cumsum(axis=1)
    actions = (reached <= draws[:, None] * reached[:, -1:]).sum(axis=1)
    last = logits.shape[1] - 1 - allowed[:, ::-1].argmax(axis=1)
    chosen: NDArray[np.int64] = np.minimum(actions, last)
    return chosen
