"""A batch acts as its agents do one by one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from galley.agents.agent_batch import OneByOne, batch_of
from galley.agents.bundle import Bundle, load_bundle
from galley.agents.network import NetworkAgent, NetworkAgents
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
def test_a_batch_acts_as_each_agent_alone(
    tmp_path: Path, policy: Callable[[], bytes], sampling: str, unstuck: str, seat: int
) -> None:
    shared = bundle(tmp_path, policy(), sampling=sampling, unstuck=unstuck)
    together = batch_of(shared, ROOM, seat, SEEDS)
    assert isinstance(together, NetworkAgents)
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
            taken = np.zeros((1, 6), dtype=np.bool_)
            if agent.alone.unstuck is not None:
                agent.alone.unstuck.bar(state[None], taken)
            barred += bool(taken.any())
        joint = np.stack([actions, others[tick]][:: 1 - 2 * seat], axis=1)
        together.observe(states, joint)
        for agent, state, (one, other) in zip(alone, states, joint.tolist(), strict=True):
            agent.observe(state, (one, other))
        kitchens.step(joint)
    assert unstuck == "none" or barred > 10


def shipped(name: str) -> Bundle:
    return load_bundle(Workspace(ROOT).find("agents", name), name)


def test_agents_without_a_network_are_asked_one_by_one() -> None:
    together = batch_of(shipped("myopic"), ROOM, 0, [1, 2])
    assert isinstance(together, OneByOne)
    states = KitchenBatch(ROOM, 2).states
    actions = together.act(states, 0)
    alone = shipped("myopic").make()
    alone.reset(ROOM, 0, 2)
    assert actions[1] == alone.act(states[1], 0)
    together.observe(states, np.stack([actions, actions], axis=1))


def test_nobody_is_a_batch_and_unknown_layouts_are_told() -> None:
    assert batch_of(shipped("human-bc"), ROOM, 0, []).act(KitchenBatch(ROOM, 0).states, 0).shape == (0,)
    with pytest.raises(GalleyError, match="human-bc does not know layout 'nowhere'"):
        batch_of(shipped("human-bc"), Layout("nowhere", ROOM.grid), 0, [1])
