"""The log of a training run: its columns and the row of an update."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from galley.learning.ppo.learner import Learner
    from galley.learning.ppo.rollout import Rollout
    from galley.learning.ppo.update import UpdateMetrics

COLUMNS: Final = (
    "ticks",
    "generation",
    "update",
    "score",
    "stage",
    "shaping",
    "policy_loss",
    "value_loss",
    "entropy",
    "clip_fraction",
    "approx_kl",
    "explained_variance",
    "seconds",
)
"""Columns of `log.csv`: ticks learned from in the whole run, generation or member at work, its update, mean
score of the update's episodes, what the run is doing, extra reward an episode, metrics of the update, seconds
at work."""

FORMER_COLUMNS: Final = {"clipped": "clip_fraction", "divergence": "approx_kl"}
"""Columns of logs that earlier versions wrote, with their names of today."""


def log_row(
    learner: Learner, rollout: Rollout, metrics: UpdateMetrics, *, ticks: int, generation: int, stage: str
) -> dict[str, Any]:
    """The row of one update."""
    return {
        "ticks": ticks,
        "generation": generation,
        "update": learner.done,
        "score": float(rollout.scores.mean()),
        "stage": stage,
        "shaping": float(rollout.shaping.sum(dim=(0, 1)).mean()),
        **dataclasses.asdict(metrics),
    }
