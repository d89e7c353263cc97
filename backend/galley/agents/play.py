"""Two agents playing together, many games at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from galley.agents.batch import batch_of
from galley.agents.bundle import Bundle
from galley.kitchen import KitchenBatch, Layout


@dataclass(frozen=True)
class PlayResult:
    """The scores of one seat order."""

    seat_0: str
    seat_1: str
    layout: str
    scores: tuple[int, ...]

    @property
    def games(self) -> int:
        """How many games were played."""
        return len(self.scores)

    @property
    def mean(self) -> float:
        """The mean score."""
        return float(np.mean(self.scores))

    @property
    def standard_error(self) -> float:
        """The standard error of the mean, 0 for a single game."""
        return float(np.std(self.scores, ddof=1) / np.sqrt(self.games)) if self.games > 1 else 0.0


def play(a: Bundle, b: Bundle, layout: Layout, games: int, seed: int) -> tuple[PlayResult, PlayResult]:
    """The results of `games` games with `a` on seat 0, and of as many others with `b` on seat 0.

    Raises:
        GalleyError: an agent does not know the layout.
    """
    first, second = np.random.SeedSequence(seed).spawn(2)
    return (
        play_in_seats((a, b), layout, first.generate_state(games, np.uint64).tolist()),
        play_in_seats((b, a), layout, second.generate_state(games, np.uint64).tolist()),
    )


def play_in_seats(seats: tuple[Bundle, Bundle], layout: Layout, seeds: Sequence[int]) -> PlayResult:
    """The result of one game per seed, all played side by side to their ends."""
    kitchens = KitchenBatch(layout, len(seeds))
    batches = [batch_of(bundle, layout, seat, seeds) for seat, bundle in enumerate(seats)]
    scores = np.zeros(len(seeds), dtype=np.int64)
    tick = 0
    while not kitchens.done.all():
        states = kitchens.states.copy()
        actions = np.stack([agents.act(states, tick) for agents in batches], axis=1)
        for agents in batches:
            agents.observe(states, actions)
        scores += kitchens.step(actions)
        tick += 1
    return PlayResult(seats[0].name, seats[1].name, layout.name, tuple(scores.tolist()))
