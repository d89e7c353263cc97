"""The last stage of FCP and MEP: a new policy learns to cook with everybody in a population."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from galley.kitchen import Layout
from galley.learning.methods.milestones import checkpoint
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.learner import Learner, kitchens_of
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import Episodes, Pairing, derived_seed
from galley.learning.training_log import log_row
from galley.runs.stepwise import Step

PARTNERS = 6
"""Partners drawn for an update, each for as many kitchens. Ours: more make small batches, fewer are noisy."""


class BestResponse:
    """A learner whose partners are drawn by how hard they are to score with.

    Partner i gets probability proportional to rank(i)^alpha, where the partner with the lowest mean score so
    far has the highest rank, n; equal scores share theirs. alpha 0 draws uniformly.

    Source: Zhao et al. 2023 (arXiv:2112.11701), Sec. 4.3, prioritised sampling; alpha 0 is FCP.
    """

    def __init__(
        self,
        layout: Layout,
        settings: PPOSettings,
        updates: int,
        seed: int,
        machine: Machine,
        *,
        alpha: float,
        memory: float = 0.8,
    ) -> None:
        self.seed = seed
        self.alpha = alpha
        self.memory = memory
        self.learner = Learner(layout, settings, updates, derived_seed(seed, 30), machine)
        self.episodes = Episodes(layout, kitchens_of(layout, settings), machine)
        self.scores: NDArray[np.float64] = np.empty(0)

    @property
    def finished(self) -> bool:
        """Whether all updates are done."""
        return self.learner.done >= self.learner.updates

    def step(self, population: list[Policy], *, ticks_before: int, generation: int) -> Step[Policy]:
        """One update with partners of the population."""
        if len(self.scores) != len(population):
            self.scores = np.full(len(population), np.nan)
        generator = np.random.default_rng(derived_seed(self.seed, 31, self.learner.done))
        count = min(PARTNERS, len(population), self.episodes.batch.size)
        drawn = generator.choice(
            len(population), size=count, replace=False, p=priorities(self.scores, self.alpha)
        )
        size = self.episodes.batch.size
        shares = np.diff(np.arange(count + 1) * size // count).tolist()
        pairings = [
            Pairing(population[one], share) for one, share in zip(drawn.tolist(), shares, strict=True)
        ]
        rollout, metrics = self.learner.learn(self.episodes, pairings)
        start = 0
        for one, share in zip(drawn.tolist(), shares, strict=True):
            score = float(rollout.scores[start : start + share].mean())
            start += share
            before = score if np.isnan(self.scores[one]) else self.scores[one]
            self.scores[one] = self.memory * before + (1 - self.memory) * score
        row = log_row(
            self.learner, rollout, metrics,
            ticks=ticks_before + self.learner.ticks, generation=generation, stage="best response",
        )  # fmt: skip
        name = checkpoint(self.learner.done, self.learner.updates)
        return Step(row, {} if name is None else {name: self.learner.frozen()})

    def state(self) -> dict[str, Any]:
        """What `restore` needs."""
        return {"learner": self.learner.state(), "scores": torch.from_numpy(self.scores.copy())}

    def restore(self, state: dict[str, Any]) -> None:
        """Go back to where `state` was taken."""
        self.learner.restore(state["learner"])
        self.scores = state["scores"].numpy().copy()


def priorities(scores: NDArray[np.float64], alpha: float) -> NDArray[np.float64]:
    """float64 [n]: the probability of each partner from its mean score so far, float [n].

    A partner without a score (NaN) counts as the hardest.
    """
    filled = np.where(np.isnan(scores), -np.inf, scores)
    ranks = len(filled) - np.array([np.count_nonzero(filled < score) for score in filled])
    weights = ranks.astype(np.float64) ** alpha
    found: NDArray[np.float64] = weights / weights.sum()
    return found
