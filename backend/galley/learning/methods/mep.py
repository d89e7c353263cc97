"""Maximum-entropy population: policies that differ from each other, then a response to the hard ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch

from galley.kitchen import Layout
from galley.learning.methods.best_response import BestResponse
from galley.learning.methods.milestones import STAGES
from galley.learning.methods.self_play import SelfPlay
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.games import probabilities
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import Rollout, derived_seed
from galley.runs.stepwise import Step


class MEP:
    """MEP: `size` policies in self-play, in turn, paid for what the population as a whole rarely does.

    The extra reward of an action is -weight log of the mean probability that the population gives it. Three
    checkpoints of each policy then are the partners of a best response with prioritised sampling.

    Source: Zhao et al. 2023 (arXiv:2112.11701), Sec. 4, Eq. 7 and Algorithm 1; weight in points of the score.
    """

    def __init__(
        self,
        layout: Layout,
        settings: PPOSettings,
        *,
        size: int = 5,
        weight: float = 0.01,
        alpha: float = 3.0,
        self_play_updates: int,
        updates: int,
        seed: int,
        machine: Machine,
        response: PPOSettings | None = None,
    ) -> None:
        self.weight = weight * settings.reward_scale
        self.trainings = [
            SelfPlay(layout, settings, self_play_updates, derived_seed(seed, 50, number), machine)
            for number in range(size)
        ]
        self.population: dict[str, Policy] = {}
        self.response = BestResponse(layout, response or settings, updates, seed, machine, alpha=alpha)
        self.total = size * self_play_updates + updates

    @property
    def finished(self) -> bool:
        """Whether the best response has done its updates."""
        return self.response.finished

    @property
    def share(self) -> float:
        """How many of all updates are done, 0 to 1."""
        return (self._done + self.response.learner.done) / self.total

    def step(self) -> Step[Policy]:
        """One update of the policy whose turn it is, or of the best response."""
        size = len(self.trainings)
        ticks = self.response.learner.settings.ticks
        if all(training.finished for training in self.trainings):
            return self.response.step(
                list(self.population.values()), ticks_before=self._done * ticks, generation=size
            )
        number = self._done % size
        training = self.trainings[number]
        step = training.step(self._bonus, stage="population")
        step.row.update(ticks=self._done * ticks, generation=number)
        joined = {}
        if training.finished:
            joined = {f"{number:02}-{stage}": step.joined[stage] for stage in STAGES}
        self.population.update(joined)
        return Step(step.row, joined)

    def state(self) -> dict[str, Any]:
        """All but the weights of the population."""
        return {
            "trainings": [training.state() for training in self.trainings],
            "population": list(self.population),
            "response": self.response.state(),
        }

    def restore(self, state: dict[str, Any], member: Callable[[str], Policy]) -> None:
        """Go back to where `state` was taken."""
        for training, kept in zip(self.trainings, state["trainings"], strict=True):
            training.restore(kept, member)
        self.population = {name: member(name) for name in state["population"]}
        self.response.restore(state["response"])

    def best(self) -> Policy:
        """The best response."""
        return self.response.learner.frozen()

    @property
    def _done(self) -> int:
        """Updates that the policies of the population have done together."""
        return sum(training.learner.done for training in self.trainings)

    def _bonus(self, rollout: Rollout) -> torch.Tensor:
        """float32 [T, N]: the population-entropy reward of what was done."""
        seen = rollout.seen.flatten(0, 1)
        each = [probabilities(training.learner.policy, seen) for training in self.trainings]
        mean = torch.stack(each).mean(dim=0)
        done = mean.gather(1, rollout.actions.flatten().unsqueeze(1)).clamp_min(1e-8)
        return (-self.weight * done.log()).view(rollout.actions.shape)
