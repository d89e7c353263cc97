"""Episodes of agents: many side by side are each by itself, and whoever takes one up acts on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from galley.agents.bundle import load_bundle
from galley.agents.episode import play_both_orders, play_episode, play_episodes, take_up
from galley.agents.scripted import Random
from galley.kitchen import Kitchen
from galley.kitchen.trajectory import play
from galley.workspace import Workspace
from tests.agents.policies import ROOM, bundle, linear_policy, summing_policy

ROOT = Path(__file__).resolve().parents[2]


def test_a_batch_of_games_is_each_game_by_itself(tmp_path: Path) -> None:
    layout = ROOM.with_rules(horizon_ticks=150)
    network = bundle(tmp_path, linear_policy(bias=[1, 1, 1, 1, 0, 3]))
    myopic = load_bundle(Workspace(ROOT).find("agents", "myopic"), "myopic")
    together = play_episodes(layout, (myopic, network), [5, 6, 7])
    for seed, score in zip((5, 6, 7), together.tolist(), strict=True):
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
        alone = play_episode(layout, (myopic.make(), network.make()), seed)
        assert play(layout, alone.joint_actions).score == score
    assert max(together.tolist()) > 0


def test_both_seat_orders_are_played_and_repeat_with_the_seed() -> None:
    workspace = Workspace(ROOT)
    stay, myopic = (load_bundle(workspace.find("agents", name), name) for name in ("stay", "myopic"))
    both = play_both_orders(stay, myopic, ROOM, 3, seed=4)
    seeds = [one.generate_state(3, np.uint64).tolist() for one in np.random.SeedSequence(4).spawn(2)]
    assert both[0].tolist() == play_episodes(ROOM, (stay, myopic), seeds[0]).tolist()
    assert both[1].tolist() == play_episodes(ROOM, (myopic, stay), seeds[1]).tolist()
    again = play_both_orders(stay, myopic, ROOM, 3, seed=4)
    assert [one.tolist() for one in again] == [one.tolist() for one in both]
    assert both[0].shape == both[1].shape == (3,)


def test_an_episode_ends_at_its_horizon_or_sooner_when_asked() -> None:
    layout = ROOM.with_rules(horizon_ticks=12)
    for ticks, played in ((None, 12), (5, 5), (0, 0), (40, 12)):
        episode = play_episode(layout, (Random(), Random()), 3, ticks)
        assert episode.joint_actions.shape == (played, 2)
        assert episode.seed == 3


def test_an_agent_that_takes_up_an_episode_acts_as_the_one_that_played_it(tmp_path: Path) -> None:
    network = bundle(tmp_path, summing_policy())
    episode = play_episode(ROOM, (network.make(), network.make()), 8, 60)
    states = play(ROOM, episode.joint_actions).states
    for seat in (0, 1):
        agent = network.make()
        take_up(agent, ROOM, seat, 8, episode.joint_actions[:40])
        for tick in range(40, 60):
            joint = episode.joint_actions[tick].tolist()
            assert agent.act(states[tick], tick) == joint[seat]
            agent.observe(states[tick], (joint[0], joint[1]))


def test_games_that_end_early_end_for_themselves(tmp_path: Path) -> None:
    layout = ROOM.with_rules(orders=("onion",))
    myopic = load_bundle(Workspace(ROOT).find("agents", "myopic"), "myopic")
    assert play_episodes(layout, (myopic, myopic), [1, 2]).tolist() == [20, 20]
