"""Fictitious co-play: a best response to self-play policies of several seeds and skills."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from galley.kitchen import Layout
from galley.learning.methods.best_response import BestResponse
from galley.learning.methods.milestones import STAGES
from galley.learning.methods.self_play import SelfPlay
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import derived_seed
from galley.runs.stepwise import Step


class FCP:
    """FCP: self-play runs one after another, three checkpoints of each, then a best response to them all.

    With a `pool`, policies by name, the self-play runs have been made before and are left out.

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
        response: PPOSettings | None = None,
        pool: Mapping[str, Policy] | None = None,
    ) -> None:
        self.pool = dict(pool or {})
        self.seeds = 0 if self.pool else seeds
        self.self_play_updates = self_play_updates
        self._make = lambda number: SelfPlay(
            layout, settings, self_play_updates, derived_seed(seed, 40, number), machine
        )
        self.population: dict[str, Policy] = dict(self.pool)
        self.response = BestResponse(layout, response or settings, updates, seed, machine, alpha=0.0)
        self.number = 0
        self.training: SelfPlay = self._make(0)

    @property
    def finished(self) -> bool:
        """Whether the best response has done its updates."""
        return self.response.finished

    @property
    def share(self) -> float:
        """How many of all updates are done, 0 to 1."""
        done = self.number * self.self_play_updates + self.response.learner.done
        if self.number < self.seeds:
            done += self.training.learner.done
        return done / (self.seeds * self.self_play_updates + self.response.learner.updates)

    def step(self) -> Step[Policy]:
        """One update of the self-play run at work, or of the best response."""
        learner = self.training.learner
        ticks_before = self.number * self.self_play_updates * learner.settings.ticks
        if self.number >= self.seeds:
            return self.response.step(
                list(self.population.values()), ticks_before=ticks_before, generation=self.seeds
            )
        step = self.training.step()
        step.row.update(ticks=ticks_before + learner.ticks, generation=self.number)
        if not self.training.finished:
            return Step(step.row)
        joined = {f"{self.number:02}-{stage}": step.joined[stage] for stage in STAGES}
        self.population.update(joined)
        self.number += 1
        if self.number < self.seeds:
            self.training = self._make(self.number)
        return Step(step.row, joined)

    def state(self) -> dict[str, Any]:
        """All but the weights of the population."""
        return {
            "number": self.number,
            "training": self.training.state(),
            "population": [name for name in self.population if name not in self.pool],
            "response": self.response.state(),
        }

    def restore(self, state: dict[str, Any], member: Callable[[str], Policy]) -> None:
        """Go back to where `state` was taken."""
        self.number = state["number"]
        self.training = self._make(max(0, min(self.number, self.seeds - 1)))
        self.training.restore(state["training"], member)
        self.population = {**self.pool, **{name: member(name) for name in state["population"]}}
        self.response.restore(state["response"])

    def best(self) -> Policy:
        """The best response."""
        return self.response.learner.frozen()
