"""Many agents of one bundle on the same seat of as many kitchens, asked all at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from galley.agents.bundle import Bundle
from galley.agents.choosing import choose, draws_for
from galley.agents.network import NetworkAgent
from galley.agents.protocol import Agent
from galley.kitchen import Layout

_WORD = (1 << 64) - 1


class Crew(Protocol):
    """The agents of B kitchens; their answers are those that each agent gives by itself."""

    def act(self, states: NDArray[np.int16], tick: int) -> NDArray[np.int64]:
        """int64 [B]: an action for each state (int16 [B, S]) at this tick."""

    def observe(self, states: NDArray[np.int16], joint_actions: NDArray[np.integer]) -> None:
        """Note what was done (integer [B, 2]) in the states that `act` was last asked about."""


def crew(bundle: Bundle, layout: Layout, seat: int, seeds: Sequence[int]) -> Crew:
    """The agents of a bundle on one seat, a kitchen for each seed, at the beginning of their episodes.

    Raises:
        GalleyError: the bundle does not know the layout.
    """
    agents = [bundle.make() for _ in seeds]
    for agent, seed in zip(agents, seeds, strict=True):
        agent.reset(layout, seat, seed)
    first = agents[0] if agents else None
    return NetworkCrew(first, seeds) if isinstance(first, NetworkAgent) else EachAlone(agents)


class EachAlone:
    """A crew whose agents are asked one after the other."""

    def __init__(self, agents: Sequence[Agent]) -> None:
        self.agents = agents

    def act(self, states: NDArray[np.int16], tick: int) -> NDArray[np.int64]:
        """int64 [B]: as `Crew.act`."""
        actions = [agent.act(state, tick) for agent, state in zip(self.agents, states, strict=True)]
        return np.array(actions, dtype=np.int64)

    def observe(self, states: NDArray[np.int16], joint_actions: NDArray[np.integer]) -> None:
        """Note what was done: as `Crew.observe`."""
        for agent, state, joint in zip(self.agents, states, joint_actions.tolist(), strict=True):
            agent.observe(state, (joint[0], joint[1]))


class NetworkCrew:
    """A crew of network agents: one run of the network a tick, memory and unstuck rule held in arrays.

    `first` is one of the agents, just reset; `seeds` are those of all.
    """

    def __init__(self, first: NetworkAgent, seeds: Sequence[int]) -> None:
        self.network, self.encoder, self.seat = first.network, first.encoder, first.seat
        size = len(seeds)
        self._seeds = np.array([seed & _WORD for seed in seeds], dtype=np.uint64)
        self._seats = np.full(size, first.seat, dtype=np.int64)
        self._sampled = first.sampling == "sample"
        start = self.network.start()
        self._memories = None if start is None else np.tile(start, (size, *(1,) * start.ndim))
        self._following: NDArray[np.float32] | None = None
        self._after = first.unstuck_after_ticks
        ticks = self._after or 0
        self._poses = np.zeros((ticks, size, 2), dtype=np.int16)
        self._actions = np.zeros((ticks, size), dtype=np.int64)
        self._ticks_seen = 0

    def act(self, states: NDArray[np.int16], tick: int) -> NDArray[np.int64]:
        """int64 [B]: as `Crew.act`."""
        observations = self.encoder.seat(states, self._seats).astype(np.float32)
        logits, self._following = self.network.run(observations, self._memories)
        draws = None
        if self._sampled:
            draws = draws_for(self._seeds, self._seats, np.full(len(states), tick, dtype=np.int64))
        return choose(logits, self._barred(states, logits.shape), draws)

    def observe(self, states: NDArray[np.int16], joint_actions: NDArray[np.integer]) -> None:
        """Note what was done: as `Crew.observe`."""
        if self._after is not None:
            place = self._ticks_seen % self._after
            self._poses[place] = self._pose(states)
            self._actions[place] = joint_actions[:, self.seat]
        self._ticks_seen += 1
        self._memories = self._following

    def _pose(self, states: NDArray[np.int16]) -> NDArray[np.int16]:
        """int16 [B, 2]: own cell and facing."""
        return states[:, 3 * self.seat : 3 * self.seat + 2]

    def _barred(self, states: NDArray[np.int16], shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """bool [B, 6]: the actions of the last N ticks of those who stood in one pose throughout."""
        barred = np.zeros(shape, dtype=np.bool_)
        if self._after is not None and self._ticks_seen > self._after:
            stuck = np.flatnonzero((self._poses == self._pose(states)).all(axis=(0, 2)))
            for actions in self._actions:
                barred[stuck, actions[stuck]] = True
        return barred
