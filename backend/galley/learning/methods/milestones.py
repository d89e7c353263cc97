"""Checkpoints of a policy at three skills: untrained, half as good, trained."""

from __future__ import annotations

import copy
from typing import Any, Final

from galley.learning.ppo.policy import Policy

STAGES: Final = ("early", "half", "final")
KEPT: Final = 20
CHECKPOINTS: Final = 50


class Milestones:
    """Snapshots along a training of `updates` updates, from which three are chosen at its end.

    Source: Strouse et al. 2021 (arXiv:2110.08176), Sec. 3: the first checkpoint, the last, and one that
    reaches half of the last one's reward.
    """

    def __init__(self, updates: int) -> None:
        self.updates = updates
        self._every = max(1, updates // KEPT)
        self._kept: list[dict[str, Any]] = []

    def note(self, done: int, score: float, policy: Policy) -> None:
        """Keep the policy where `done` updates are on the grid; `score` is that update's."""
        if done % self._every == 0 or done in (0, self.updates):
            weights = {name: tensor.cpu().clone() for name, tensor in policy.state_dict().items()}
            self._kept.append({"score": score, "weights": weights})

    def chosen(self, like: Policy) -> dict[str, Policy]:
        """The three policies by the names of their stages."""
        first, last = self._kept[0], self._kept[-1]
        half = next(one for one in self._kept if one["score"] >= last["score"] / 2)
        return dict(zip(STAGES, (_loaded(like, one["weights"]) for one in (first, half, last)), strict=True))

    def state(self) -> list[dict[str, Any]]:
        """What `restore` needs."""
        return list(self._kept)

    def restore(self, state: list[dict[str, Any]]) -> None:
        """Go back to where `state` was taken."""
        self._kept = list(state)


def _loaded(like: Policy, weights: dict[str, Any]) -> Policy:
    policy = copy.deepcopy(like)
    policy.load_state_dict(weights)
    return policy.requires_grad_(False)


def checkpoint(done: int, updates: int) -> str | None:
    """The name of the checkpoint that is due after `done` of `updates` updates, None where none is.

    Source: COLE paper, Sec. 7.3: 50 checkpoints, uniform along a training, are compared.
    """
    number = CHECKPOINTS * done // max(1, updates)
    return f"{number:04}" if number > CHECKPOINTS * (done - 1) // max(1, updates) else None
