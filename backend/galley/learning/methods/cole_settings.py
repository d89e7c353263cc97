"""The constants of COLE."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Solver = Literal["shapley", "reward"]


@dataclass(frozen=True)
class ColeSettings:
    """How COLE grows its population. Source: COLE paper, Sec. 5, App. C, unless said otherwise."""

    solver: Solver = "shapley"
    """Graphic Shapley value (COLE-SV) or reward (COLE-R)."""
    generations: int = 70
    """Strategies that are trained."""
    updates: int = 10
    """PPO updates of a generation."""
    ratio: tuple[int, int] = (1, 3)
    """Parts of an update's kitchens played with itself, and with partners from the distribution."""
    cap: int = 50
    """Largest population."""
    partners: int | None = None
    """Partners drawn for an update, who share all but its own kitchens; None: one for each part."""
    exploration: float = 0.01
    """SUCG's c. Ours: a strategy never visited gets about as much as one of fifty after 25 updates."""
    share: float = 0.1
    """Rank k as a share of the population; from a public re-implementation, as no source states it."""
    tries: int = 3
    """How often a generation's updates are made again until its strategy ranks; same source."""
    tries_from: int = 10
    """Size of the population from which ranks are asked for. Ours: among fewer, a rank says little."""
    permutations: int = 2000
    """Monte Carlo permutations of the Shapley value. Ours."""
    games: int = 5
    """Games of a payoff on either seat. Ours."""
    weighted: bool = True
    """Whether solvers weigh by PageRank (False: the ablation COLE-SV minus WPG)."""

    @property
    def drawn(self) -> int:
        """Partners drawn for an update."""
        return self.ratio[1] if self.partners is None else self.partners

    def problems(self) -> list[str]:
        """What cannot be, each with its fix."""
        found = []
        if min(self.ratio) < 0 or self.ratio[1] < 1:
            found.append(f"ratio is {self.ratio[0]}:{self.ratio[1]}; use one of 0:4 1:3 2:2 3:1")
        for name in ("generations", "updates", "tries", "games", "permutations", "partners"):
            if getattr(self, name) is not None and getattr(self, name) < 1:
                found.append(f"{name} is {getattr(self, name)}; use a whole number of at least 1")
        if self.cap < 2:
            found.append(f"cap is {self.cap}; use at least 2")
        if self.exploration < 0 or not 0 < self.share <= 1:
            found.append("exploration must be at least 0, share above 0 and at most 1")
        return found
