"""The constants of PPO, with their sources."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from galley.errors import GalleyError


@dataclass(frozen=True)
class PPOSettings:
    """How proximal policy optimisation is done.

    Source: COLE paper, App. C; where it is silent, Carroll et al. 2019 (arXiv:1910.05789), App. C and code.
    """

    learning_rate: float = 8e-4
    """Of Adam."""
    final_rate_share: float = 1.0
    """What is left of the learning rate at the end of the run; it falls linearly."""
    ticks: int = 48_000
    """Kitchen ticks an update learns from: whole episodes."""
    minibatches: int = 10
    """Parts that the rows of an update are cut into, anew in each epoch."""
    epochs: int = 8
    """Passes over the rows of an update."""
    gamma: float = 0.99
    """Discount a tick."""
    lambda_: float = 0.98
    """Of generalised advantage estimation."""
    clip: float = 0.05
    """How far the probability of an action may move away from that at play, as a ratio."""
    value_coefficient: float = 0.5
    """Weight of the value's squared error."""
    max_gradient_norm: float = 0.1
    """Longer gradients are shortened to this."""
    entropy_start: float = 0.1
    """Weight of the policy's entropy at the beginning; it falls linearly."""
    entropy_end: float = 0.02
    """Weight of the entropy at the end of the run. The sources keep 0.1; see docs/learning.md."""
    reward_scale: float = 0.05
    """What rewards are multiplied by before anything is learned from them, so that a soup is 1."""
    shaping_ticks: float = 2.5e6
    """Ticks over which the extra reward of `KitchenBatch.shaping` falls linearly to 0."""
    partner_shaping: float = 1.0
    """Weight of what the other seat does within the extra reward, 0 to 1."""

    def problems(self) -> list[str]:
        """What cannot be, each with its fix."""
        found = []
        for name in ("learning_rate", "reward_scale", "max_gradient_norm"):
            if not getattr(self, name) > 0:
                found.append(f"{name} is {getattr(self, name)}; use a number above 0")
        for name in ("ticks", "minibatches", "epochs"):
            if getattr(self, name) < 1:
                found.append(f"{name} is {getattr(self, name)}; use a whole number of at least 1")
        for name in ("gamma", "lambda_", "final_rate_share", "partner_shaping"):
            if not 0 <= getattr(self, name) <= 1:
                found.append(f"{name} is {getattr(self, name)}; use a number from 0 to 1")
        for name in ("clip", "value_coefficient", "entropy_start", "entropy_end", "shaping_ticks"):
            if not getattr(self, name) >= 0:
                found.append(f"{name} is {getattr(self, name)}; use a number of at least 0")
        return found

    def changed(self, **changes: Any) -> PPOSettings:
        """The same with some constants changed.

        Raises:
            GalleyError: a value cannot be.
        """
        made = replace(self, **changes)
        problems = made.problems()
        if problems:
            raise GalleyError("; ".join(problems))
        return made
