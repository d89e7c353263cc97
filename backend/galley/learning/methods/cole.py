"""COLE: each generation learns with the strategies of its population that are hard to cook with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.evaluation.game_graph import (
    PayoffTable,
    accepted,
    draw_partners,
    graphic_shapley,
    preference_centrality,
    removal,
    reward_solver,
)
from galley.kitchen import Layout
from galley.learning.methods.cole_settings import ColeSettings
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.games import games_with
from galley.learning.ppo.learner import Learner, kitchens_of
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import Episodes, Pairing, derived_seed
from galley.learning.training_log import log_row
from galley.runs.stepwise import Step

_DEAL, _SOLVE, _PAYOFFS, _REMOVE = range(20, 24)
_FIRST: Final = "0000"


class Cole:
    """COLE-SV and COLE-R.

    The population begins with `first`, policies by name that are never removed, or with one untrained
    strategy. The first generation begins untrained, each other goes on from the strategy before it, with
    kitchens dealt to itself and to partners drawn by SUCG for every update; then the payoffs of the new
    strategy with all others are measured on both seats. If its preference centrality does not rank among the
    best, its updates go on, up to the given tries.

    Source: COLE paper, Algorithm 1.

    Raises:
        GalleyError: settings that cannot be.
    """

    def __init__(
        self,
        layout: Layout,
        settings: PPOSettings,
        cole: ColeSettings,
        seed: int,
        machine: Machine,
        first: Mapping[str, Policy] | None = None,
    ) -> None:
        problems = cole.problems()
        kitchens = kitchens_of(layout, settings)
        if kitchens < cole.ratio[0] + max(cole.ratio[1], cole.drawn):
            problems.append(
                f"{settings.ticks} ticks make {kitchens} kitchens, too few for ratio {cole.ratio} "
                f"and {cole.drawn} partners"
            )
        if first and len(first) >= cole.cap:
            problems.append(
                f"the pool has {len(first)} strategies, which all stay; "
                f"give at most {cole.cap - 1}, as a population holds {cole.cap}"
            )
        if problems:
            raise GalleyError("; ".join(problems))
        self.layout, self.cole, self.seed, self.machine = layout, cole, seed, machine
        self.learner = Learner(
            layout, settings, cole.generations * cole.updates, derived_seed(seed, 10), machine
        )
        self.episodes = Episodes(layout, kitchens, machine)
        self.generation = 0
        self.tried = 0
        self.made = 0
        self.pooled = len(first or ())
        self.first = dict(first or {_FIRST: self.learner.frozen()})
        self.visits: NDArray[np.int64] = np.zeros(len(self.first), dtype=np.int64)
        self.table = PayoffTable()
        self.members: list[Policy] = []
        for name, policy in self.first.items():
            self._join(name, policy)
        self.phi = self._solved()

    @property
    def finished(self) -> bool:
        """Whether all generations are there."""
        return self.generation >= self.cole.generations

    @property
    def share(self) -> float:
        """How much is done, 0 to 1, further tries left out."""
        return min(1.0, (self.generation + self.made / self.cole.updates) / self.cole.generations)

    def step(self) -> Step[Policy]:
        """One update, and at the end of a generation the payoffs of its strategy."""
        rollout, metrics = self.learner.learn(self.episodes, self._pairings(), both=True, progress=self.share)
        self.made += 1
        row = log_row(
            self.learner, rollout, metrics,
            ticks=self.learner.ticks, generation=self.generation + 1, stage=f"try {self.tried + 1}",
        )  # fmt: skip
        if self.made < self.cole.updates:
            return Step(row)
        return Step(row, self._end())

    def state(self) -> dict[str, Any]:
        """All but the weights of the members."""
        return {
            "learner": self.learner.state(),
            "generation": self.generation,
            "tried": self.tried,
            "made": self.made,
            "phi": torch.from_numpy(self.phi.copy()),
            "visits": torch.from_numpy(self.visits.copy()),
            "names": list(self.table.names),
            **{
                part: torch.from_numpy(numbers)
                for part, numbers in self.table.arrays().items()
                if part != "names"
            },
        }

    def restore(self, state: dict[str, Any], member: Callable[[str], Policy]) -> None:
        """Go back to where `state` was taken."""
        self.learner.restore(state["learner"])
        self.generation, self.tried, self.made = state["generation"], state["tried"], state["made"]
        self.phi, self.visits = state["phi"].numpy().copy(), state["visits"].numpy().copy()
        arrays = {part: state[part].numpy() for part in ("mean", "standard_error", "games")}
        self.table = PayoffTable.from_arrays({"names": np.array(state["names"], dtype=np.str_), **arrays})
        self.members = [self.first[name] if name in self.first else member(name) for name in self.table.names]

    def best(self) -> Policy:
        """The strategy of the last generation."""
        return self.learner.frozen()

    def _pairings(self) -> list[Pairing]:
        """The kitchens of the next update, dealt by the ratio; drawn partners count as visited."""
        own, others = self.cole.ratio
        count = self.cole.drawn
        generator = np.random.default_rng(derived_seed(self.seed, _DEAL, self.learner.done))
        drawn, self.visits = draw_partners(self.phi, self.visits, self.cole.exploration, count, generator)
        partners: list[Policy | None] = [None] * own + [self.members[one] for one in drawn.tolist()]
        parts = np.array([0] + [count] * own + [others] * count).cumsum()
        shares = np.diff(parts * self.episodes.batch.size // parts[-1]).tolist()
        return [Pairing(partner, share) for partner, share in zip(partners, shares, strict=True)]

    def _end(self) -> dict[str, Policy]:
        """The policy that joined at the end of a generation, by its name; none if it is to be tried again."""
        self.made = 0
        name = f"{self.generation + 1:04}"
        number = self._join(name, self.learner.frozen())
        ranked = accepted(preference_centrality(self.table.payoffs()), number, self.cole.share)
        self.tried += 1
        if not ranked and self.tried < self.cole.tries and number + 1 >= self.cole.tries_from:
            self.table.remove(number)
            self.members.pop()
            return {}
        self.generation, self.tried = self.generation + 1, 0
        self.visits = np.append(self.visits, 0)
        gone = removal(
            len(self.table),
            np.random.default_rng(derived_seed(self.seed, _REMOVE, self.generation)),
            cap=self.cole.cap,
            kept=self.pooled,
        )
        if gone is not None:
            self.table.remove(gone)
            self.visits = np.delete(self.visits, gone)
            del self.members[gone]
        self.phi = self._solved()
        return {name: self.members[-1]}

    def _join(self, name: str, policy: Policy) -> int:
        """The number of a policy in the population, its payoffs measured."""
        self.members.append(policy)
        number = self.table.add(name)
        seed = derived_seed(self.seed, _PAYOFFS, self.learner.done, number)
        scores = games_with(self.layout, policy, self.members, self.cole.games, seed, self.machine)
        for other, games in enumerate(scores):
            self.table.measure(number, other, games[0])
            if other != number:
                self.table.measure(other, number, games[1])
        return number

    def _solved(self) -> NDArray[np.float64]:
        """The cooperative incompatibility distribution of the population."""
        payoffs = self.table.payoffs()
        if self.cole.solver == "reward":
            return reward_solver(payoffs, self.cole.weighted)
        generator = np.random.default_rng(derived_seed(self.seed, _SOLVE, self.generation))
        return graphic_shapley(payoffs, self.cole.permutations, generator, self.cole.weighted)
