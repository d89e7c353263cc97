"""From the logits of networks to actions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from galley.compiled.kernels import kernel


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
    actions = np.empty(len(logits), dtype=np.int64)
    if draws is None:
        _best(np.ascontiguousarray(logits), barred, actions)
    else:
        _sampled(np.ascontiguousarray(logits), barred, draws, actions)
    return actions


@kernel
def _largest(logits: NDArray[np.float32], barred: NDArray[np.bool_]) -> int:
    """The first place of the largest of the logits that are not barred, -1 if all are."""
    best = -1
    for action in range(len(logits)):
        if not barred[action] and (best < 0 or logits[action] > logits[best]):
            best = action
    return best


@kernel
def _best(logits: NDArray[np.float32], barred: NDArray[np.bool_], actions: NDArray[np.int64]) -> None:
    for row in range(len(logits)):
        best = _largest(logits[row], barred[row])
        actions[row] = best if best >= 0 else _largest(logits[row], np.zeros_like(barred[row]))


@kernel
def _sampled(
    logits: NDArray[np.float32],
    barred: NDArray[np.bool_],
    draws: NDArray[np.float64],
    actions: NDArray[np.int64],
) -> None:
    weights = np.empty(logits.shape[1], dtype=np.float64)
    for row in range(len(logits)):
        best = _largest(logits[row], barred[row])
        free = best < 0
        if free:
            best = _largest(logits[row], np.zeros_like(barred[row]))
        total = 0.0
        for action in range(len(weights)):
            weight = 0.0
            if free or not barred[row, action]:
                weight = math.exp(float(logits[row, action]) - float(logits[row, best]))
            total += weight
            weights[action] = weight
        wanted = draws[row] * total
        reached = 0.0
        for action in range(len(weights)):
            if weights[action] > 0:
                actions[row] = action
                reached += weights[action]
                if reached > wanted:
                    break
