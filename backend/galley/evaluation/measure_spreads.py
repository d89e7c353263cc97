"""Medians and spread of the measures of many trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from galley.kitchen.measures import Measures

DIFFERENCES = ("ingredients", "dishes", "served")
"""Measures per chef, told as seat 0 minus seat 1 (robot minus human)."""


@dataclass(frozen=True)
class Spread:
    """The median, the quartiles and the ends of one measure over trials."""

    median: float
    lower: float
    upper: float
    least: float
    most: float


def trial_measures(trial: Measures, robot_seat: int = 0) -> dict[str, float]:
    """The measures of one trial as plain numbers; differences are robot minus human.

    Performance is left out where there is no order list.
    """
    sign = 1 if robot_seat == 0 else -1
    found: dict[str, float] = {
        "ticks": trial.ticks,
        "score": trial.score,
        "orders": len(trial.delivery_ticks),
        "concurrent_share": trial.concurrent_share,
        "concurrent_ticks": trial.concurrent_ticks,
        "stuck_ticks": trial.stuck_ticks,
    }
    for name in DIFFERENCES:
        one, other = getattr(trial, name)
        found[f"{name}_difference"] = sign * (one - other)
    if trial.performance is not None:
        found["performance"] = trial.performance
    return found


def spreads(trials: Sequence[dict[str, float]]) -> dict[str, Spread]:
    """The spread of each figure over the trials.

    Source: Fontaine et al. 2021 (RSS), App. D-D: medians, as performance is rank-based.
    """
    found = {}
    for name in trials[0]:
        values = [trial[name] for trial in trials]
        least, lower, median, upper, most = np.quantile(values, (0, 0.25, 0.5, 0.75, 1)).tolist()
        found[name] = Spread(median, lower, upper, least, most)
    return found
