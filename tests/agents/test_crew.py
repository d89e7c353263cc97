"""A crew acts as its agents do one by one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from galley.agents.bundle import Bundle, load_bundle
from galley.agents.crew import EachAlone, NetworkCrew, crew
from galley.agents.network import NetworkAgent
from galley.errors import GalleyError
from galley.kitchen import KitchenBatch, Layout
from galley.workspace import Workspace
from tests.agents.policies import ROOM, bundle, linear_policy, summing_policy

ROOT = Path(__file__).resolve().parents[2]
SEEDS = [3, 1, 2**64 - 1, -5, 3]


def lingering() -> bytes:
    """A policy that stays or interacts most of the time, so that the unstuck rule has work."""
    return linear_policy(bias=[0, 0, 0, 0, 3, 2], scale=0.05)


@pytest.mark.parametrize("seat", [0, 1])
@pytest.mark.parametrize(
    ("policy", "sampling", "unstuck"),
    [
        (linear_policy, "sample", "none"),
        (lingering, "sample", "3"),
        (lingering, "argmax", "1"),
        (lingering, "argmax", "7"),
        (summing_policy, "sample", "3"),
        (summing_policy, "argmax", "none"),
    ],
)
def test_a_crew_acts_as_each_agent_alone(
    tmp_path: Path, policy: Callable[[], bytes], sampling: str, unstuck: str, seat: int
) -> None:
    shared = bundle(tmp_path, policy(), sampling=sampling, unstuck=unstuck)
    together = crew(shared, ROOM, seat, SEEDS)
    assert isinstance(together, NetworkCrew)
    alone = [shared.make() for _ in SEEDS]
    for agent, seed in zip(alone, SEEDS, strict=True):
        agent.reset(ROOM, seat, seed)
    kitchens = KitchenBatch(ROOM, len(SEEDS))
    others = np.random.default_rng(4).integers(0, 6, (120, len(SEEDS)))
    barred = 0
    for tick in range(120):
        states = kitchens.states.copy()
        actions = together.act(states, tick)
        assert (together.act(states, tick) == actions).all()
        assert actions.tolist() == [
            agent.act(state, tick) for agent, state in zip(alone, states, strict=True)
        ]
        for agent, state in zip(alone, states, strict=True):
            assert isinstance(agent, NetworkAgent)
            barred += bool(agent.taken_while_stuck(state))
        joint = np.stack([actions, others[tick]][:: 1 - 2 * seat], axis=1)
        together.observe(states, joint)
        for agent, state, (one, other) in zip(alone, states, joint.tolist(), strict=True):
            agent.observe(state, (one, other))
        kitchens.step(joint)
    assert unstuck == "none" or barred > 10


def shipped(name: str) -> Bundle:
    return load_bundle(Workspace(ROOT).find("agents", name), name)


def test_agents_without_a_network_are_asked_one_by_one() -> None:
    together = crew(shipped("myopic"), ROOM, 0, [1, 2])
    assert isinstance(together, EachAlone)
    states = KitchenBatch(ROOM, 2).states
    actions = together.act(states, 0)
    alone = shipped("myopic").make()
    alone.reset(ROOM, 0, 2)
    assert actions[1] == alone.act(states[1], 0)
    together.observe(states, np.stack([actions, actions], axis=1))


def test_nobody_is_a_crew_and_unknown_layouts_are_told() -> None:
    assert crew(shipped("human-bc"), ROOM, 0, []).act(KitchenBatch(ROOM, 0).states, 0).shape == (0,)
    with pytest.raises(GalleyError, match="human-bc does not know layout 'nowhere'"):
        crew(shipped("human-bc"), Layout("nowhere", ROOM.grid), 0, [1])
