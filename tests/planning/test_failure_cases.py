"""Kitchens in which not knowing the human's subtask costs an order: Fig. 7 of the LSI paper."""

from __future__ import annotations

import numpy as np
import pytest

from galley.kitchen import Layout
from galley.kitchen.codes import DELIVERIES
from galley.kitchen.trajectory import play
from galley.planning.trials import run

CORRIDOR = Layout.from_ascii(
    "corridor",
    """
    XXPXXXXXX
    X  XXX12X
    O       X
    S  XXX  X
    XXXXXXPDX
    """,
    cook_time_ticks=10,
)
BLOCKED_POT = Layout.from_ascii(
    "blocked pot",
    """
    XXXXXXX
    XX XP X
    S1    X
    D 2   X
    XXP OXX
    XXXOXXX
    """,
    cook_time_ticks=10,
)


@pytest.mark.parametrize("layout", [CORRIDOR, BLOCKED_POT], ids=lambda layout: layout.name)
def test_a_robot_that_sees_the_subtask_is_ahead_by_an_order(layout: Layout) -> None:
    seeds = np.arange(40, dtype=np.uint64)
    orders = {
        robot: [
            int(play(layout, actions).states[-1, DELIVERIES])
            for actions in run(layout, robot, 0.0, seeds).joint_actions
        ]
        for robot in ("mdp", "qmdp")
    }
    assert np.median(orders["mdp"]) - np.median(orders["qmdp"]) >= 1
    assert np.mean(orders["mdp"]) - np.mean(orders["qmdp"]) >= 1
