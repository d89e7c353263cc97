"""Self-play: a policy learns with itself on both seats."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from galley.kitchen import Layout
from galley.learning.learner import Bonus, Learner, Machine, kitchens_of
from galley.learning.policy import Policy
from galley.learning.rollout import Episodes, Pairing, derived_seed
from galley.learning.settings import PPOSettings
from galley.learning.training import Told, row_of


class SelfPlay:
    """SP. Source: Carroll et al. 2019 (arXiv:1910.05789), Sec. 4.1; both seats' rows are learned from."""

    def __init__(
        self, layout: Layout, settings: PPOSettings, updates: int, seed: int, machine: Machine
    ) -> None:
        self.learner = Learner(layout, settings, updates, derived_seed(seed, 10), machine)
        self.episodes = Episodes(layout, kitchens_of(layout, settings), machine.device)

    @property
    def finished(self) -> bool:
        """Whether all updates are done."""
        return self.learner.done >= self.learner.updates

    @property
    def share(self) -> float:
        """How many of the updates are done, 0 to 1."""
        return self.learner.progress

    def step(self, bonus: Bonus | None = None, *, stage: str = "self-play") -> Told:
        """One update with itself."""
        kitchens = self.episodes.batch.size
        rollout, figures = self.learner.learn(
            self.episodes, [Pairing(None, kitchens)], both=True, bonus=bonus
        )
        return Told(
            row_of(self.learner, rollout, figures, ticks=self.learner.ticks, generation=0, stage=stage)
        )

    def state(self) -> dict[str, Any]:
        """That of the learner."""
        return self.learner.state()

    def restore(self, state: dict[str, Any], member: Callable[[str], Policy]) -> None:
        """Nothing; goes back to where `state` was taken."""
        self.learner.restore(state)

    def best(self) -> Policy:
        """The policy as it is."""
        return self.learner.frozen()
