"""Population-based training: a few policies learn with each other; bad ones copy good ones and vary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from galley.kitchen import Layout
from galley.learning.methods.milestones import checkpoint
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.games import games_with
from galley.learning.ppo.learner import Learner, kitchens_of
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import Episodes, Pairing, derived_seed
from galley.learning.training_log import log_row
from galley.runs.stepwise import Step

MUTATED: Final = (
    "lambda_", "clip", "learning_rate", "epochs", "entropy_start", "entropy_end", "value_coefficient",
)  # fmt: skip
"""What a copied policy varies, each with a chance, by a factor; the two ends of the entropy together."""

CHANCE: Final = 0.33
FACTORS: Final = (0.75, 1.25)


class PBT:
    """PBT: every ordered pair of the population trains once, in random order; then the worst is replaced.

    In a pair the first learns with the second, who stays as it is; who meets itself plays both seats and
    learns from both. After size^2 pairings each policy plays `games` games on either seat with all others
    and itself; the policy with the worst mean gets weights, optimiser and constants of the best, and the
    constants vary.

    Source: Carroll et al. 2019 (arXiv:1910.05789), Sec. 4.1, App. C; Jaderberg et al. 2017
    (arXiv:1711.09846).
    """

    def __init__(
        self,
        layout: Layout,
        settings: PPOSettings,
        *,
        size: int = 3,
        games: int = 6,
        updates: int,
        seed: int,
        machine: Machine,
    ) -> None:
        self.layout, self.games, self.seed, self.machine = layout, games, seed, machine
        self.learners = [
            Learner(layout, settings, updates, derived_seed(seed, 60, number), machine)
            for number in range(size)
        ]
        self.episodes = Episodes(layout, kitchens_of(layout, settings), machine)
        self.done = 0
        self.total = size * updates
        self.scores = [0.0] * size

    @property
    def finished(self) -> bool:
        """Whether the policies have done their updates on average."""
        return self.done >= self.total

    @property
    def share(self) -> float:
        """How many of all updates are done, 0 to 1."""
        return self.done / self.total

    def step(self) -> Step[Policy]:
        """One pairing, and after the last of a round the selection."""
        size = len(self.learners)
        turn, place = divmod(self.done, size * size)
        order = np.random.default_rng(derived_seed(self.seed, 61, turn)).permutation(size * size)
        number, other = divmod(int(order[place]), size)
        learner = self.learners[number]
        partner = None if number == other else self.learners[other].frozen()
        pairing = Pairing(partner, self.episodes.batch.size)
        rollout, metrics = learner.learn(self.episodes, [pairing], both=True)
        self.done += 1
        row = log_row(
            learner, rollout, metrics,
            ticks=self.done * learner.settings.ticks, generation=number, stage=f"with {other}",
        )  # fmt: skip
        if place == size * size - 1 or self.finished:
            self._select(turn, vary=not self.finished)
        name = checkpoint(self.done, self.total)
        return Step(row, {} if name is None else {name: self.best()})

    def state(self) -> dict[str, Any]:
        """All of it."""
        return {
            "learners": [learner.state() for learner in self.learners],
            "settings": [asdict(learner.settings) for learner in self.learners],
            "done": self.done,
            "scores": list(self.scores),
        }

    def restore(self, state: dict[str, Any], member: Callable[[str], Policy]) -> None:
        """Go back to where `state` was taken."""
        for learner, kept, settings in zip(self.learners, state["learners"], state["settings"], strict=True):
            learner.restore(kept)
            learner.settings = PPOSettings(**settings)
        self.done = state["done"]
        self.scores = list(state["scores"])

    def best(self) -> Policy:
        """The policy that scored best in the last selection."""
        return self.learners[int(np.argmax(self.scores))].frozen()

    def _select(self, turn: int, *, vary: bool) -> None:
        """Measure everybody and let the worst copy the best."""
        policies = [learner.frozen() for learner in self.learners]
        self.scores = [
            float(
                games_with(
                    self.layout, policy, policies, self.games, derived_seed(self.seed, 62, turn, number),
                    self.machine,
                ).mean()
            )
            for number, policy in enumerate(policies)
        ]  # fmt: skip
        worst, best = int(np.argmin(self.scores)), int(np.argmax(self.scores))
        if not vary or worst == best:
            return
        copied, loser = self.learners[best], self.learners[worst]
        done = loser.done
        loser.restore(copied.state())
        loser.seed, loser.done = derived_seed(self.seed, 63, turn), done
        loser.settings = mutated(copied.settings, np.random.default_rng(derived_seed(self.seed, 64, turn)))


def mutated(settings: PPOSettings, generator: np.random.Generator) -> PPOSettings:
    """The settings, each constant of `MUTATED` changed with probability 0.33 by a factor of 0.75 or 1.25.

    Shares stay within 0 to 1, epochs are whole.
    """
    changes: dict[str, Any] = {}
    entropy = float(generator.choice(FACTORS)) if generator.random() < CHANCE else 1.0
    for name in MUTATED:
        value = getattr(settings, name)
        if name.startswith("entropy"):
            changes[name] = value * entropy
        elif generator.random() < CHANCE:
            factor = float(generator.choice(FACTORS))
            changes[name] = max(1, round(value * factor)) if name == "epochs" else value * factor
    if "lambda_" in changes:
        changes["lambda_"] = min(changes["lambda_"], 1.0)
    return settings.changed(**changes)
