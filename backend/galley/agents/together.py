"""Many agents asked at once."""

from __future__ import annotations

from collections.abc import Sequence

from numpy import int16
from numpy.typing import NDArray

from galley.agents.network import NetworkAgent, act_as_one
from galley.agents.protocol import Agent


def act_together(
    agents: Sequence[Agent], states: Sequence[NDArray[int16]], ticks: Sequence[int]
) -> list[int]:
    """The action of each agent in its own state (int16 [S]) and tick, the same as each gives by itself.

    Agents of one network are answered by a single run of it, whatever rounds they play in.
    """
    actions = [0] * len(agents)
    groups: dict[object, list[tuple[int, NetworkAgent]]] = {}
    for place, agent in enumerate(agents):
        if isinstance(agent, NetworkAgent):
            groups.setdefault(agent.companions(), []).append((place, agent))
        else:
            actions[place] = agent.act(states[place], ticks[place])
    for members in groups.values():
        places = [place for place, _ in members]
        found = act_as_one(
            [agent for _, agent in members],
            [states[place] for place in places],
            [ticks[place] for place in places],
        )
        for place, action in zip(places, found, strict=True):
            actions[place] = action
    return actions
