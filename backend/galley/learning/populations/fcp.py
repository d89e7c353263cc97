"""Fictitious co-play: a best response to self-play policies of several seeds and skills."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from galley.kitchen import Layout
from galley.learning.learner import Machine
from galley.learning.policy import Policy
from galley.learning.populations.best_response import BestResponse
from galley.learning.populations.milestones import STAGES, Milestones
from galley.learning.populations.self_play import SelfPlay
from galley.learning.rollout import derived_seed
from galley.learning.settings import PPOSettings
from galley.learning.training import Told


class FCP:
    """FCP: `seeds` self-play runs one after another, three checkpoints of each, then a best response.

    Source: Strouse et al. 2021 (arXiv:2110.08176), Sec. 3 (they used 32 seeds).
    """

    def __init__(
        self,
        layout: Layout,
        settings: PPOSettings,
        *,
        seeds: int,
        self_play_updates: int,
        updates: int,
        seed: int,
        machine: Machine,
    ) -> None:
        self.seeds = seeds
        self._make = lambda number: SelfPlay(
            layout, settings, self_play_updates, derived_seed(seed, 40, number), machine
        )
        self.population: dict[str, Policy] = {}
        self.response = BestResponse(layout, settings, updates, seed, machine, alpha=0.0)
        self.total = seeds * self_play_updates + updates
        self._begin(0)

    @property
    def finished(self) -> bool:
        """Whether the best response has done its updates."""
        return self.response.finished

    @property
    def share(self) -> float:
        """How many of all updates are done, 0 to 1."""
        if self.number >= self.seeds:
            return 1 - (self.response.learner.updates - self.response.learner.done) / self.total
        done = self.number * self.training.learner.updates + self.training.learner.done
        return done / self.total

    def step(self) -> Told:
        """One update of the self-play run at work, or of the best response."""
        learner = self.training.learner
        ticks_before = min(self.number, self.seeds) * learner.updates * learner.settings.ticks
        if self.number >= self.seeds:
            return self.response.step(
                list(self.population.values()), ticks_before=ticks_before, generation=self.seeds
            )
        told = self.training.step()
        told.row.update(ticks=ticks_before + learner.ticks, generation=self.number)
        self.milestones.note(learner.done, told.row["score"], learner.policy)
        if not self.training.finished:
            return told
        chosen = self.milestones.chosen(learner.policy)
        joined = {f"{self.number:02}-{stage}": chosen[stage] for stage in STAGES}
        self.population.update(joined)
        if self.number + 1 < self.seeds:
            self._begin(self.number + 1)
        else:
            self.number = self.seeds
        return Told(told.row, joined)

    def state(self) -> dict[str, Any]:
        """All but the weights of the population."""
        return {
            "number": self.number,
            "training": self.training.state(),
            "milestones": self.milestones.state(),
            "population": list(self.population),
            "response": self.response.state(),
        }

    def restore(self, state: dict[str, Any], member: Callable[[str], Policy]) -> None:
        """Nothing; goes back to where `state` was taken."""
        self._begin(min(state["number"], self.seeds - 1))
        self.number = state["number"]
        self.training.restore(state["training"], member)
        self.milestones.restore(state["milestones"])
        self.population = {name: member(name) for name in state["population"]}
        self.response.restore(state["response"])

    def best(self) -> Policy:
        """The best response."""
        return self.response.learner.frozen()

    def _begin(self, number: int) -> None:
        """Nothing; starts the self-play run of a number."""
        self.number = number
        self.training = self._make(number)
        self.milestones = Milestones(self.training.learner.updates)
        self.milestones.note(0, 0.0, self.training.learner.policy)
