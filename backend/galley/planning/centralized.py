"""One plan for both chefs, and the agent that plays its part in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen.codes import DELIVERIES, ORDERS_DELIVERED, STAY
from galley.kitchen.layout import Layout
from galley.kitchen.rules import step
from galley.planning.brain import brain
from galley.planning.team_kernel import LEG_TICKS, Search, search_plan

ORDERS_AHEAD = 3
"""Orders planned for at a time when there is no order list."""
BEYOND = 3
"""Orders after those whose likely cost counts, so that a plan leaves the kitchen prepared."""
WIDTH = 64
"""Nodes kept per tick in the search for a plan that nobody waits for."""
WIDTH_SMALL = 100
"""The same in a kitchen of at most `SMALL` floor cells."""
SMALL = 12
WIDTH_PLAYING = 24
"""The same for an agent's first plan and after one has been carried out."""
WIDTH_AFRESH = 3
"""The same when the world has deviated from the plan, which may happen every tick."""
PAIRS_SMALL = 30
PAIRS = 16
"""Pairs of subtasks tried from each node."""
MOST_TICKS = 300
"""The length of the longest plan searched for."""


@dataclass(frozen=True, eq=False)
class TeamPlan:
    """Joint actions uint8[T, 2] and the states int16[T + 1, S] they lead through.

    `complete` is False when the search reached its limit before the orders were served; the plan
    then leads to the most promising state found.
    """

    joint_actions: NDArray[np.uint8]
    states: NDArray[np.int16]
    complete: bool


class TeamPlanner:
    """Near-optimal joint plans on one layout, by A* over pairs of subtasks with joint motion costs.

    Raises:
        GalleyError: the layout cannot be served (the message names the station) or is too large.
    """

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._brain = brain(layout, 0, team=True)
        self._searches: dict[int, Search] = {}

    def plan(
        self,
        state: NDArray[np.int16],
        orders: int | None = None,
        width: int | None = None,
        most_ticks: int = MOST_TICKS,
    ) -> TeamPlan:
        """The plan from `state` (int16[S]) until `orders` more soups are served (else `ORDERS_AHEAD`).

        No more than what is left of an order list; the orders after them count by their likely cost.

        Raises:
            GalleyError: less than one order or tick is asked for.
        """
        listed = self.layout.rules.orders
        left = None if listed is None else len(listed) - int(state[ORDERS_DELIVERED])
        known = ORDERS_AHEAD + BEYOND if left is None else left
        wanted = min(known, ORDERS_AHEAD) if orders is None else orders
        if wanted < 1 or (width is not None and width < 1) or most_ticks < 1:
            raise GalleyError("a plan needs at least one order, one node a tick and one tick")
        beyond = max(0, min(BEYOND, known - wanted))
        thorough = width is None and len(self.layout.floor) <= SMALL
        if width is None:
            width = WIDTH_SMALL if thorough else WIDTH
        pairs = PAIRS_SMALL if thorough else PAIRS
        search = self._search(width, most_ticks)
        node, complete = search_plan(self._brain, search, state, wanted, beyond, pairs, thorough)
        legs = []
        while search.parents[node] >= 0:
            legs.append(search.legs[node, : search.lengths[node]])
            node = int(search.parents[node])
        actions = np.concatenate([*legs[::-1], np.empty((0, 2), dtype=np.uint8)])
        states = np.empty((len(actions) + 1, state.size), dtype=np.int16)
        states[0] = state
        out = np.zeros(4, dtype=np.int32)
        for tick, (act0, act1) in enumerate(actions.tolist()):
            states[tick + 1] = states[tick]
            step(self.layout.spec, states[tick + 1], act0, act1, out)
        return TeamPlan(actions, states, bool(complete))

    def _search(self, width: int, ticks: int) -> Search:
        key = width * 100_000 + ticks
        keys = 1 << min(20, (width * ticks * PAIRS).bit_length())
        if key not in self._searches:
            nodes = width * ticks
            size = self.layout.width * self.layout.height + 9
            self._searches[key] = Search(
                states=np.zeros((nodes, size), dtype=np.int16),
                parents=np.zeros(nodes, dtype=np.int32),
                legs=np.zeros((nodes, LEG_TICKS, 2), dtype=np.uint8),
                lengths=np.zeros(nodes, dtype=np.int16),
                totals=np.zeros(nodes, dtype=np.float32),
                counts=np.zeros(ticks, dtype=np.int32),
                keys=np.zeros(keys, dtype=np.uint64),
                times=np.zeros(keys, dtype=np.int16),
            )
        return self._searches[key]


class Centralized:
    """An agent that plays its part in a plan for both chefs, trusting the other to play theirs.

    The plan is carried out open-loop. When the world is not as planned, a new plan is made from there;
    without an order list also after each soup served, always for the next two orders.

    Source: Fontaine et al. 2021 (RSS), Sec. IV "Centralized Planning".
    """

    def __init__(self) -> None:
        self._layout: Layout | None = None
        self._planner: TeamPlanner | None = None
        self._seat = 0
        self._plan: TeamPlan | None = None
        self._at = 0

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode; the seed changes nothing.

        Raises:
            GalleyError: the layout cannot be served (the message names the station) or is too large.
        """
        if self._planner is None or layout != self._layout:
            self._planner = TeamPlanner(layout)
            self._layout = layout
        self._seat = seat
        self._plan, self._at = None, 0

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """This seat's part in the plan's next joint action; to stay when no plan leads on."""
        plan, at = self._current(state)
        self._plan, self._at = plan, at
        return int(plan.joint_actions[at, self._seat]) if at < len(plan.joint_actions) else STAY

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Move on in the plan that was in force in `state`."""
        plan, at = self._current(state)
        self._plan, self._at = plan, at + 1

    def _current(self, state: NDArray[np.int16]) -> tuple[TeamPlan, int]:
        """The plan in force in a state, and the place of the state in it."""
        if self._planner is None:
            raise GalleyError("the agent has no layout yet; call reset first")
        plan, at = self._plan, self._at
        listed = self._planner.layout.rules.orders is not None
        if plan is None:
            return self._planner.plan(state, width=WIDTH_PLAYING), 0
        if at >= len(plan.states) or not np.array_equal(plan.states[at], state):
            return self._planner.plan(state, width=WIDTH_AFRESH), 0
        served = state[DELIVERIES] > plan.states[0][DELIVERIES]
        if at == len(plan.joint_actions) or (served and not listed):
            return self._planner.plan(state, width=WIDTH_PLAYING), 0
        return plan, at
