"""Agents asked many at a time: those of one seat of many kitchens, or those of whatever rounds are played."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from galley.agents.bundle import Bundle
from galley.agents.network import NetworkAgent, NetworkAgents, decide
from galley.agents.protocol import Agent
from galley.kitchen import Layout


class Batch(Protocol):
    """The agents of one seat of B kitchens; their answers are those that each agent gives by itself."""

    def act(self, states: NDArray[np.int16], tick: int) -> NDArray[np.int64]:
        """int64 [B]: an action for each state (int16 [B, S]) at this tick."""

    def observe(self, states: NDArray[np.int16], joint_actions: NDArray[np.integer]) -> None:
        """Note what was done (integer [B, 2]) in these states (int16 [B, S])."""


def batch_of(bundle: Bundle, layout: Layout, seat: int, seeds: Sequence[int]) -> Batch:
    """The agents of a bundle on one seat, a kitchen for each seed, at the beginning of their episodes.

    Raises:
        GalleyError: the bundle does not know the layout.
    """
    agents = [bundle.make() for _ in seeds]
    for agent, seed in zip(agents, seeds, strict=True):
        agent.reset(layout, seat, seed)
    first = agents[0] if agents else None
    return first.beside(seeds) if isinstance(first, NetworkAgent) else OneByOne(agents)


class OneByOne:
    """A batch whose agents are asked one after the other."""

    def __init__(self, agents: Sequence[Agent]) -> None:
        self.agents = agents

    def act(self, states: NDArray[np.int16], tick: int) -> NDArray[np.int64]:
        """int64 [B]: as `Batch.act`."""
        actions = [agent.act(state, tick) for agent, state in zip(self.agents, states, strict=True)]
        return np.array(actions, dtype=np.int64)

    def observe(self, states: NDArray[np.int16], joint_actions: NDArray[np.integer]) -> None:
        """Note what was done: as `Batch.observe`."""
        for agent, state, joint in zip(self.agents, states, joint_actions.tolist(), strict=True):
            agent.observe(state, (joint[0], joint[1]))


def act_all(agents: Sequence[Agent], states: Sequence[NDArray[np.int16]], ticks: Sequence[int]) -> list[int]:
    """The action of each agent in its own state (int16 [S]) and tick, the same as each gives by itself.

    Agents of one network are answered by a single run of it, whatever rounds they play in.
    """
    actions = [0] * len(agents)
    groups: dict[object, list[tuple[int, NetworkAgents]]] = {}
    for place, agent in enumerate(agents):
        if isinstance(agent, NetworkAgent):
            groups.setdefault(agent.companions(), []).append((place, agent.alone))
        else:
            actions[place] = agent.act(states[place], ticks[place])
    for group in groups.values():
        places = [place for place, _ in group]
        found = decide(
            [one for _, one in group],
            np.stack([states[place] for place in places]),
            np.array([ticks[place] for place in places], dtype=np.int64),
        )
        for place, action in zip(places, found.tolist(), strict=True):
            actions[place] = action
    return actions
