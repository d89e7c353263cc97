"""One plan for both chefs, and the agent that plays its part in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen.codes import CELLS, CHEF, DELIVERIES, HELD, ORDERS_DELIVERED, POT_TICKS, STAY
from galley.kitchen.layout import Layout
from galley.kitchen.rules import step
from galley.kitchen.trajectory import start
from galley.planning.brain import brain
from galley.planning.myopic import Myopic
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
"""The same for an agent's first plan, made before the round begins."""
WIDTH_AFRESH = 2
"""The same for every later plan, which must be there within a tick."""
PAIRS_SMALL = 30
PAIRS_AFRESH = 6
ORDERS_AFRESH = 1
PAIRS = 16
"""Pairs of subtasks tried from each node."""
PATIENCE_TICKS = 12
"""Ticks without anything taken, put or served after which an agent whose partner does not play its part
goes on as the myopic human until the next soup is served."""
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
        pairs: int | None = None,
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
        if pairs is None:
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

    The plan is carried out open-loop. When the world is not as planned, a new plan is made from there, and
    from then on every plan is a quick one; without an order list there is a new plan after each soup served.
    Who waits in vain for a partner that does not play its part cooks one soup as the myopic human does.

    Source: Fontaine et al. 2021 (RSS), Sec. IV "Centralized Planning".
    """

    def __init__(self) -> None:
        self._layout: Layout | None = None
        self._planner: TeamPlanner | None = None
        self._seat = 0
        self._plan: TeamPlan | None = None
        self._at, self._deviated, self._stalled = 0, False, 0
        self._made = np.zeros(0, dtype=np.int16)
        self._alone = Myopic()

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode with a plan; the seed settles random moves of an agent that waited in vain.

        Raises:
            GalleyError: the layout cannot be served (the message names the station) or is too large.
        """
        if self._planner is None or layout != self._layout:
            self._planner = TeamPlanner(layout)
            self._layout = layout
        self._seat = seat
        self._plan, self._at = self._planner.plan(start(layout), width=WIDTH_PLAYING), 0
        self._deviated, self._stalled = False, 0
        self._made = np.full(3 + layout.width * layout.height, -1, dtype=np.int16)
        self._alone.reset(layout, seat, seed)

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """This seat's part in the plan's next joint action; to stay when no plan leads on."""
        self._plan, self._at, self._deviated = plan, at, _ = self._current(state)
        if self._deviated and self._stalled >= PATIENCE_TICKS:
            return self._alone.act(state, tick)
        return int(plan.joint_actions[at, self._seat]) if at < len(plan.joint_actions) else STAY

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Move on in the plan that was in force in `state`."""
        self._plan, at, self._deviated = self._current(state)
        self._at = at + 1
        self._alone.observe(state, joint_action)
        now = _made(state, self._made.size)
        if self._stalled >= PATIENCE_TICKS:  # until the next soup is served
            self._stalled = self._stalled if now[2] == self._made[2] else 0
        else:
            self._stalled = self._stalled + 1 if np.array_equal(now, self._made) else 0
        self._made = now

    def _current(self, state: NDArray[np.int16]) -> tuple[TeamPlan, int, bool]:
        """The plan in force in a state, the place of the state in it, and whether the world ever deviated."""
        if self._planner is None or self._plan is None:
            raise GalleyError("the agent has no layout yet; call reset first")
        plan, at = self._plan, self._at
        if at >= len(plan.states) or not np.array_equal(plan.states[at], state):
            return _afresh(self._planner, state), 0, True
        served = state[DELIVERIES] > plan.states[0][DELIVERIES]
        listed = self._planner.layout.rules.orders is not None
        if at < len(plan.joint_actions) and (listed or not served):
            return plan, at, self._deviated
        return _afresh(self._planner, state), 0, self._deviated


def _afresh(planner: TeamPlanner, state: NDArray[np.int16]) -> TeamPlan:
    return planner.plan(state, orders=ORDERS_AFRESH, width=WIDTH_AFRESH, pairs=PAIRS_AFRESH)


def _made(state: NDArray[np.int16], size: int) -> NDArray[np.int16]:
    """int16[3 + H*W]: what is held, soups served, what lies about and is in pots, cooking times left out."""
    found = np.empty(size, dtype=np.int16)
    found[0], found[1], found[2] = state[HELD], state[CHEF + HELD], state[DELIVERIES]
    found[3:] = state[CELLS:] % POT_TICKS
    return found
