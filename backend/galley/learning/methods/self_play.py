"""Self-play: a policy learns with itself on both seats."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from galley.kitchen import Layout
from galley.learning.methods.milestones import Milestones, checkpoint
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.learner import Bonus, Learner, kitchens_of
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import Episodes, Pairing, derived_seed
from galley.learning.training_log import log_row
from galley.runs.stepwise import Step


class SelfPlay:
    """SP: both seats' rows are learned from; three milestones on the way are kept, for FCP and MEP.

    Source: Carroll et al. 2019 (arXiv:1910.05789), Sec. 4.1.
    """

    def __init__(
        self, layout: Layout, settings: PPOSettings, updates: int, seed: int, machine: Machine
    ) -> None:
        self.learner = Learner(layout, settings, updates, derived_seed(seed, 10), machine)
        self.episodes = Episodes(layout, kitchens_of(layout, settings), machine)
        self.milestones = Milestones(updates)
        self.milestones.note(0, 0.0, self.learner.policy)

    @property
    def finished(self) -> bool:
        """Whether all updates are done."""
        return self.learner.done >= self.learner.updates

    @property
    def share(self) -> float:
        """How many of the updates are done, 0 to 1."""
        return self.learner.progress

    def step(self, bonus: Bonus | None = None, *, stage: str = "self-play") -> Step[Policy]:
        """One update with itself."""
        kitchens = self.episodes.batch.size
        rollout, metrics = self.learner.learn(
            self.episodes, [Pairing(None, kitchens)], both=True, bonus=bonus
        )
        row = log_row(self.learner, rollout, metrics, ticks=self.learner.ticks, generation=0, stage=stage)
        self.milestones.note(self.learner.done, row["score"], self.learner.policy)
        joined = self.milestones.chosen(self.learner.policy) if self.finished else {}
        name = checkpoint(self.learner.done, self.learner.updates)
        return Step(row, joined if name is None else {name: self.learner.frozen(), **joined})

    def state(self) -> dict[str, Any]:
        """All of it."""
        return {"learner": self.learner.state(), "milestones": self.milestones.state()}

    def restore(self, state: dict[str, Any], member: Callable[[str], Policy]) -> None:
        """Go back to where `state` was taken."""
        self.learner.restore(state["learner"])
        self.milestones.restore(state["milestones"])

    def best(self) -> Policy:
        """The policy as it is."""
        return self.learner.frozen()
