"""A policy in training: its network, optimiser and how far it is."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import Any

import torch

from galley.kitchen import Layout
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import Episodes, Pairing, Rollout, derived_seed
from galley.learning.ppo.update import UpdateMetrics, adam, shaping_weight, update

Bonus = Callable[[Rollout], torch.Tensor]


class Learner:
    """One policy that learns by PPO for `updates` updates on a layout.

    `seed` names the policy: its first weights, and with the number of the update every draw, follow from it.
    """

    def __init__(
        self, layout: Layout, settings: PPOSettings, updates: int, seed: int, machine: Machine
    ) -> None:
        self.layout = layout
        self.settings = settings
        self.updates = updates
        self.seed = seed
        self.machine = machine
        self.done = 0
        self.policy = Policy(layout, torch.Generator().manual_seed(derived_seed(seed, 0))).to(machine.device)
        self.optimiser = adam(self.policy, settings)

    @property
    def ticks(self) -> int:
        """Kitchen ticks learned from so far."""
        return self.done * self.settings.ticks

    @property
    def progress(self) -> float:
        """How much of the run is over, 0 to 1."""
        return min(1.0, self.done / max(1, self.updates))

    def learn(
        self,
        episodes: Episodes,
        pairings: Sequence[Pairing],
        *,
        both: bool = False,
        bonus: Bonus | None = None,
        progress: float | None = None,
    ) -> tuple[Rollout, UpdateMetrics]:
        """One update from one episode of every kitchen, shared out by `pairings`.

        `bonus` gives the extra reward [T, N] of a rollout, after scaling; `progress`, 0 to 1, sets rate and
        weight of the entropy where it is not told by the number of updates.
        """
        rollout = episodes.play(self.policy, pairings, derived_seed(self.seed, 1, self.done), both=both)
        metrics = update(
            self.policy,
            self.optimiser,
            rollout,
            self.settings,
            progress=self.progress if progress is None else progress,
            shaping=shaping_weight(self.ticks, self.settings),
            seed=derived_seed(self.seed, 2, self.done),
            bonus=None if bonus is None else bonus(rollout),
            machine=self.machine,
        )
        self.done += 1
        return rollout, metrics

    def frozen(self) -> Policy:
        """A copy of the policy as it is now, to play with."""
        return copy.deepcopy(self.policy).requires_grad_(False)

    def state(self) -> dict[str, Any]:
        """All that `restore` needs to go on from here."""
        return {
            "policy": self.policy.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "done": self.done,
            "seed": self.seed,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go back to where `state` was taken, which may be another learner's that learns on."""
        self.policy.load_state_dict(state["policy"])
        self.optimiser.load_state_dict(copy.deepcopy(state["optimiser"]))  # PyTorch would share the tensors
        self.done = int(state["done"])
        self.seed = int(state["seed"])


def kitchens_of(layout: Layout, settings: PPOSettings) -> int:
    """How many kitchens make an update's ticks: whole episodes, at least one."""
    return max(1, round(settings.ticks / layout.rules.horizon_ticks))
