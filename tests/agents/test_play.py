"""Games between agents: the same as one kitchen at a time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from galley.agents.bundle import load_bundle
from galley.agents.play import PlayResult, play, play_in_seats
from galley.kitchen import Kitchen
from galley.workspace import Workspace
from tests.agents.policies import ROOM, bundle, linear_policy

ROOT = Path(__file__).resolve().parents[2]


def test_a_batch_of_games_is_each_game_by_itself(tmp_path: Path) -> None:
    layout = ROOM.with_rules(horizon_ticks=150)
    network = bundle(tmp_path, linear_policy(bias=[1, 1, 1, 1, 0, 3]))
    myopic = load_bundle(Workspace(ROOT).find("agents", "myopic"), "myopic")
    together = play_in_seats((myopic, network), layout, [5, 6, 7])
    for seed, score in zip((5, 6, 7), together.scores, strict=True):
        kitchen = Kitchen(layout)
        pair = (myopic.make(), network.make())
        for seat, agent in enumerate(pair):
            agent.reset(layout, seat, seed)
        while not kitchen.done:
            now = kitchen.state.copy()
            joint = (pair[0].act(now, kitchen.tick), pair[1].act(now, kitchen.tick))
            kitchen.step(*joint)
            for agent in pair:
                agent.observe(now, joint)
        assert kitchen.score == score
    assert max(together.scores) > 0


def test_both_seat_orders_are_played_and_repeat_with_the_seed() -> None:
    workspace = Workspace(ROOT)
    stay, myopic = (load_bundle(workspace.find("agents", name), name) for name in ("stay", "myopic"))
    first, second = play(stay, myopic, ROOM, 3, seed=4)
    assert (first.seat_0, first.seat_1, second.seat_0, second.seat_1) == ("stay", "myopic", "myopic", "stay")
    assert play(stay, myopic, ROOM, 3, seed=4) == (first, second)
    assert first.games == second.games == 3


def test_games_that_end_early_end_for_themselves(tmp_path: Path) -> None:
    layout = ROOM.with_rules(orders=("onion",))
    myopic = load_bundle(Workspace(ROOT).find("agents", "myopic"), "myopic")
    assert play_in_seats((myopic, myopic), layout, [1, 2]).scores == (20, 20)


def test_mean_and_standard_error() -> None:
    result = PlayResult("a", "b", "room", (0, 20, 40, 60))
    assert result.mean == 30
    assert result.standard_error == pytest.approx(np.sqrt(2000 / 3 / 4))
    assert PlayResult("a", "b", "room", (20,)).standard_error == 0
