"""Kitchens judged by how a robot and a simulated human cook in them."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from galley.agents.catalogue import Catalogue
from galley.agents.episode import play_episode
from galley.agents.protocol import Agent
from galley.compiled.randomness import uniform
from galley.errors import GalleyError
from galley.evaluation.measure_spreads import spreads, trial_measures
from galley.kitchen import ACTIONS, Layout
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
    trials = [trial_measures(measures(trial), team.robot_seat) for trial in play_trials(layout, team)]
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
    robot = catalogue.bundle(team.robot).make()
    human = Noisy(catalogue.bundle(team.human).make(), team.epsilon)
    agents: tuple[Agent, Agent] = (robot, human) if team.robot_seat == 0 else (human, robot)
    return [play_episode(kitchen, agents, seed) for seed in seeds.tolist()]


class Noisy:
    """An agent that takes, with probability `epsilon`, a random action instead of its own."""

    def __init__(self, agent: Agent, epsilon: float) -> None:
        self._agent, self._epsilon = agent, epsilon
        self._seat, self._seed = 0, 0

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode, and draw from this seed and seat."""
        self._seat, self._seed = seat, seed
        self._agent.reset(layout, seat, seed)

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """The agent's action or a random one."""
        action = self._agent.act(state, tick)
        if self._epsilon > 0 and uniform(self._seed, self._seat, tick, NOISE) < self._epsilon:
            return int(uniform(self._seed, self._seat, tick, NOISY_ACTION) * len(ACTIONS))
        return action

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Let the agent observe."""
        self._agent.observe(state, joint_action)
