"""Network agents: what they take in, the unstuck rule, memory, and answers that do not hang on company."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from galley.agents.agent_batch import act_all
from galley.agents.network import NetworkAgent
from galley.agents.protocol import Agent
from galley.agents.scripted import Random, Stay
from galley.errors import GalleyError
from galley.kitchen import NORTH, SOUTH, STAY, Kitchen, KitchenBatch, Layout
from tests.agents.policies import ROOM, bundle, linear_policy, summing_policy


def start() -> NDArray[np.int16]:
    return Kitchen(ROOM).state.copy()


def fresh(folder: Path, policy: bytes, seed: int = 1, seat: int = 0, **changes: str) -> NetworkAgent:
    agent = bundle(folder, policy, **changes).make()
    agent.reset(ROOM, seat, seed)
    assert isinstance(agent, NetworkAgent)
    return agent


def test_argmax_takes_the_most_probable_and_sampling_hangs_on_seed_seat_and_tick(tmp_path: Path) -> None:
    stays = linear_policy(bias=[0, 0, 0, 0, 5, 0], scale=0.0)
    agent = fresh(tmp_path, stays, sampling="argmax")
    assert {agent.act(start(), tick) for tick in range(20)} == {STAY}
    even = bundle(tmp_path, linear_policy(scale=0.0), name="even")
    drawn = []
    for seed, seat in ((1, 0), (1, 1), (2, 0), (1, 0)):
        twin = even.make()
        twin.reset(ROOM, seat, seed)
        drawn.append([twin.act(start(), tick) for tick in range(50)])
    assert drawn[0] == drawn[3]
    assert drawn[0] != drawn[1]
    assert drawn[0] != drawn[2]
    assert set(drawn[0]) == set(range(6))


def test_stuck_means_one_tick_more_than_n_on_record_and_n_in_the_same_pose(tmp_path: Path) -> None:
    agent = fresh(tmp_path, linear_policy(bias=[0, 0, 0, 0, 9, 4], scale=0.0), sampling="argmax", unstuck="3")
    here = start()
    for _ in range(3):
        assert agent.act(here, 0) == STAY
        agent.observe(here, (STAY, STAY))
    assert agent.act(here, 3) == STAY  # three ticks are on record, a fourth is needed
    agent.observe(here, (NORTH, STAY))
    assert agent.act(here, 4) == 5  # stay and north are barred
    agent.observe(here, (5, STAY))
    assert agent.act(here, 5) == SOUTH  # of north, stay and interact none is left


def test_a_turn_ends_being_stuck_and_the_late_action_counts_not_the_wish(tmp_path: Path) -> None:
    agent = fresh(tmp_path, linear_policy(bias=[0, 0, 0, 0, 9, 4], scale=0.0), sampling="argmax", unstuck="1")
    here, turned = start(), start()
    turned[1] = 2
    agent.observe(here, (NORTH, STAY))
    agent.observe(here, (NORTH, STAY))
    assert agent.act(here, 2) == STAY  # it did north twice, so only north is barred
    agent.observe(here, (STAY, STAY))
    assert agent.act(turned, 3) == STAY
    assert agent.act(here, 3) == 5


def test_without_the_rule_nothing_is_barred(tmp_path: Path) -> None:
    agent = fresh(
        tmp_path, linear_policy(bias=[0, 0, 0, 0, 9, 4], scale=0.0), sampling="argmax", unstuck="none"
    )
    for _ in range(8):
        agent.observe(start(), (STAY, STAY))
    assert agent.act(start(), 8) == STAY


def test_a_recurrent_policy_moves_on_with_what_it_observes(tmp_path: Path) -> None:
    policy = fresh(tmp_path, summing_policy(), name="sum", unstuck="none")
    here = start()
    before = policy.act(here, 0)
    assert policy.act(here, 0) == before  # asking again changes nothing
    assert policy.alone.memories is not None
    assert not policy.alone.memories.any()
    policy.observe(here, (STAY, STAY))
    seen = policy.alone.encoder.seat(here[None], 0)
    assert np.array_equal(policy.alone.memories, seen)
    policy.observe(here, (STAY, STAY))  # never asked in this tick, as when a round is taken over
    assert np.array_equal(policy.alone.memories, 2 * seen)


POLICIES: list[Callable[[], bytes]] = [linear_policy, summing_policy]


@pytest.mark.parametrize("policy", POLICIES)
def test_many_together_act_as_each_alone(tmp_path: Path, policy: Callable[[], bytes]) -> None:
    shared = bundle(tmp_path, policy())
    other = bundle(tmp_path, linear_policy(seed=9), name="other", sampling="argmax")
    pairs: list[tuple[Agent, ...]] = []
    for _ in range(2):
        group: list[Agent] = [
            shared.make(),
            other.make(),
            shared.make(),
            Random(),
            shared.make(),
            Stay(),
            other.make(),
        ]
        for number, agent in enumerate(group):
            agent.reset(ROOM, number % 2, number)
        pairs.append(tuple(group))
    together, alone = pairs
    kitchens = KitchenBatch(ROOM, len(together))
    for tick in range(60):
        states = list(kitchens.states.copy())
        actions = act_all(together, states, [tick] * len(together))
        assert actions == [agent.act(state, tick) for agent, state in zip(alone, states, strict=True)]
        joints = [(action, 4) if number % 2 == 0 else (4, action) for number, action in enumerate(actions)]
        for group in pairs:
            for agent, state, joint in zip(group, states, joints, strict=True):
                agent.observe(state, joint)
        kitchens.step(np.array(joints))


def test_nan_is_refused_by_name(tmp_path: Path) -> None:
    agent = fresh(tmp_path, linear_policy(bias=[0, 0, float("nan"), 0, 0, 0]))
    with pytest.raises(GalleyError, match=r"room\.onnx: the logits hold NaN"):
        agent.act(start(), 0)


def test_an_unknown_layout_is_refused(tmp_path: Path) -> None:
    agent = bundle(tmp_path, linear_policy()).make()
    with pytest.raises(GalleyError, match=r"agent chef does not know layout 'rooom'.*did you mean 'room'"):
        agent.reset(Layout("rooom", ROOM.grid), 0, 0)
