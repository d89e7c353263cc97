"""Agents that play episodes: one tick by tick, or many side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from galley.agents.agent_batch import batch_of
from galley.agents.bundle import Bundle
from galley.agents.protocol import Agent
from galley.kitchen import Kitchen, KitchenBatch, Layout
from galley.kitchen.trajectory import Trajectory, play


def play_episode(
    layout: Layout, agents: tuple[Agent, Agent], seed: int, ticks: int | None = None
) -> Trajectory:
    """An episode of two agents, from their reset to its end or, if that comes first, for `ticks` ticks.

    Raises:
        GalleyError: an agent does not know the layout.
        ValueError: an agent answers with what is no action.
    """
    kitchen = Kitchen(layout)
    for seat, agent in enumerate(agents):
        agent.reset(layout, seat, seed)
    played: list[tuple[int, int]] = []
    while not kitchen.done and len(played) != ticks:
        state, tick = kitchen.state.copy(), kitchen.tick
        joint = (agents[0].act(state, tick), agents[1].act(state, tick))
        kitchen.step(*joint)
        for agent in agents:
            agent.observe(state, joint)
        played.append(joint)
    return Trajectory(layout, np.array(played, dtype=np.uint8).reshape(-1, 2), seed=seed)


def play_episodes(layout: Layout, seats: tuple[Bundle, Bundle], seeds: Sequence[int]) -> NDArray[np.int64]:
    """int64 [B]: the scores of an episode for each seed, with an agent of each bundle on its seat.

    Each is the episode that `play_episode` gives with the seed.

    Raises:
        GalleyError: a bundle does not know the layout.
    """
    kitchens = KitchenBatch(layout, len(seeds))
    batches = [batch_of(bundle, layout, seat, seeds) for seat, bundle in enumerate(seats)]
    tick = 0
    while not kitchens.done.all():
        states = kitchens.states.copy()
        actions = np.stack([agents.act(states, tick) for agents in batches], axis=1)
        kitchens.step(actions)
        for agents in batches:
            agents.observe(states, actions)
        tick += 1
    return kitchens.scores.astype(np.int64)


def play_both_orders(
    a: Bundle, b: Bundle, layout: Layout, games: int, seed: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """int64 [games], twice: the scores with `a` on seat 0, and of as many other games with `b` on seat 0.

    Raises:
        GalleyError: a bundle does not know the layout.
    """
    first, second = np.random.SeedSequence(seed).spawn(2)
    return (
        play_episodes(layout, (a, b), first.generate_state(games, np.uint64).tolist()),
        play_episodes(layout, (b, a), second.generate_state(games, np.uint64).tolist()),
    )


def take_up(agent: Agent, layout: Layout, seat: int, seed: int, joint_actions: NDArray[np.uint8]) -> None:
    """Bring an agent to where it would be had it played these ticks (uint8 [T, 2]) of an episode.

    Raises:
        GalleyError: the agent does not know the layout.
    """
    agent.reset(layout, seat, seed)
    states = play(layout, joint_actions).states
    for state, (first, second) in zip(states, joint_actions.tolist(), strict=False):
        agent.observe(state, (first, second))
