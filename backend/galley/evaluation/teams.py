"""Kitchens judged by how a robot and a simulated human cook in them."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from galley.agents.catalogue import Catalogue
from galley.agents.protocol import Agent
from galley.compiled.randomness import uniform
from galley.errors import GalleyError
from galley.evaluation.summary import figures, spreads
from galley.kitchen import ACTIONS, Kitchen, Layout
from galley.kitchen.measures import measures
from galley.kitchen.trajectory import Trajectory
from galley.planning.distances import distances
from galley.planning.solvable import require_solvable
from galley.planning.trials import NOISE, NOISY_ACTION, ROBOTS, run
from galley.workspace import Workspace

LSI_ORDERS: Final = ("onion", "onion")
"""The orders of the LSI paper's simulations, for layouts without an order list."""


@dataclass(frozen=True)
class Team:
    """Who cooks, how often and how long. `robot` sits on `robot_seat`, `human` on the other.

    Both name agents of the workspace. `epsilon` is the probability of a random action of the human; `orders`
    replaces the layout's list, an empty one means no list.
    """

    robot: str = "qmdp"
    human: str = "myopic"
    epsilon: float = 0.0
    trials: int = 50
    horizon_ticks: int = 100
    seed: int = 0
    robot_seat: int = 0
    orders: tuple[str, ...] | None = None
    workspace: str = "."


def kitchen_of(layout: Layout, team: Team) -> Layout:
    """The layout under the rules of the evaluation."""
    orders = team.orders if team.orders is not None else layout.rules.orders or LSI_ORDERS
    return layout.with_rules(horizon_ticks=team.horizon_ticks, orders=orders or None)


def evaluate(layout: Layout, team: Team) -> dict[str, Any]:
    """Medians and spread of every measure over the trials, as JSON can hold them.

    A trial's seed follows from the team's and its own number alone, so a layout's result is the same wherever
    and in whatever order layouts are evaluated.

    Raises:
        GalleyError: the layout cannot be served or an agent cannot play in it.
    """
    trials = [figures(measures(trial), team.robot_seat) for trial in play_trials(layout, team)]
    return {
        "layout": layout.name,
        "robot": team.robot,
        "human": team.human,
        "epsilon": team.epsilon,
        "trials": team.trials,
        "horizon_ticks": team.horizon_ticks,
        "seed": team.seed,
        "measures": {name: asdict(spread) for name, spread in spreads(trials).items()},
    }


def play_trials(layout: Layout, team: Team) -> list[Trajectory]:
    """Every trial of a team in a layout, in the order of their numbers.

    Raises:
        GalleyError: the layout cannot be served or an agent cannot play in it.
    """
    if not 0 <= team.epsilon <= 1 or team.trials < 1:
        raise GalleyError("epsilon must be from 0 to 1, and there must be at least one trial")
    kitchen = kitchen_of(layout, team)
    require_solvable(distances(kitchen))
    seeds = np.random.SeedSequence(team.seed).generate_state(team.trials, np.uint64).astype(np.uint64)
    if team.robot in ROBOTS and team.human == "myopic":
        found = run(kitchen, team.robot, team.epsilon, seeds, team.robot_seat)
        pairs = zip(found.joint_actions, found.ticks.tolist(), strict=True)
        return [Trajectory(kitchen, actions[:ticks]) for actions, ticks in pairs]
    catalogue = Catalogue(Workspace(Path(team.workspace)))
    agents = [catalogue.bundle(team.robot).make(), catalogue.bundle(team.human).make()]
    if team.robot_seat == 1:
        agents.reverse()
    return [
        Trajectory(kitchen, _play(kitchen, agents, 1 - team.robot_seat, team.epsilon, seed))
        for seed in seeds.tolist()
    ]


def _play(layout: Layout, agents: list[Agent], human: int, epsilon: float, seed: int) -> NDArray[np.uint8]:
    """uint8[T, 2]: the joint actions of one trial, the agents asked tick by tick."""
    kitchen = Kitchen(layout)
    for seat, agent in enumerate(agents):
        agent.reset(layout, seat, seed)
    played = []
    while not kitchen.done:
        state, tick = kitchen.state.copy(), kitchen.tick
        actions = [agent.act(state, tick) for agent in agents]
        if epsilon > 0 and uniform(seed, human, tick, NOISE) < epsilon:
            actions[human] = int(uniform(seed, human, tick, NOISY_ACTION) * len(ACTIONS))
        joint = (actions[0], actions[1])
        kitchen.step(*joint)
        for agent in agents:
            agent.observe(state, joint)
        played.append(joint)
    return np.array(played, dtype=np.uint8).reshape(-1, 2)
