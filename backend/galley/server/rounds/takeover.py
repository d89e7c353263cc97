"""Taking a round up where its journal ends: its kitchen, and agents that have seen what happened in it."""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from galley.agents.bundle import Bundle
from galley.agents.episode import take_up
from galley.agents.protocol import Agent
from galley.kitchen import Layout
from galley.kitchen.trajectory import Trajectory, episodes_of
from galley.server.rounds.round_kitchen import RoundKitchen
from galley.server.rounds.thinking import Unable

LOG = logging.getLogger(__name__)


def caught_up(layout: Layout, episodes: int, joint_actions: NDArray[np.uint8]) -> RoundKitchen:
    """The kitchen after the joint actions (uint8 [T, 2]) of all episodes so far."""
    round_kitchen = RoundKitchen(layout, episodes)
    for episode in episodes_of(Trajectory(layout, joint_actions), episodes):
        round_kitchen.take_up(episode.joint_actions)
    return round_kitchen


def ready_agent(bundle: Bundle, layout: Layout, seat: int, seed: int, seen: NDArray[np.uint8]) -> Agent:
    """An agent of the bundle that has seen an episode so far (uint8 [T, 2]), as if it had always played it.

    One that fails at that is replaced by one that stays where it is.
    """
    try:
        agent: Agent = bundle.make()
        take_up(agent, layout, seat, seed, seen)
    except Exception:  # whatever a researcher's agent raises, the round goes on
        LOG.exception("agent %s cannot take up a round on layout %s", bundle.name, layout.name)
        return Unable()
    return agent
