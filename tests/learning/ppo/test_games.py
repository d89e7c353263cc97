"""Everybody plays with everybody, each on the right seat."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from galley.kitchen import KitchenBatch
from galley.learning.ppo import games as payoffs
from galley.learning.ppo.games import games_among
from tests.learning.kitchens import CPU, SMALL, Always, policy


def test_each_policy_sits_where_its_row_and_column_say(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[NDArray[np.int64]] = []

    class Watched(KitchenBatch):
        def step(self, joint: NDArray[np.integer]) -> NDArray[np.int32]:
            steps.append(np.array(joint))
            return super().step(joint)

    monkeypatch.setattr(payoffs, "KitchenBatch", Watched)
    scores = games_among(SMALL, [Always(action) for action in (4, 1, 5)], 2, 1, CPU)
    assert scores.shape == (3, 3, 2)
    wanted = [[row, column] for row in (4, 1, 5) for column in (4, 1, 5) for _ in range(2)]
    assert len(steps) == SMALL.rules.horizon_ticks
    assert all(step.tolist() == wanted for step in steps)


def test_games_among_policies_are_seeded() -> None:
    policies = [policy(1), policy(2)]
    heard: list[tuple[int, int]] = []
    first = games_among(SMALL, policies, 3, 7, CPU, lambda done, total: heard.append((done, total)))
    assert (first == games_among(SMALL, policies, 3, 7, CPU)).all()
    assert heard[-1] == (SMALL.rules.horizon_ticks, SMALL.rules.horizon_ticks)
