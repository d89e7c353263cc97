"""The agent that plays its part in a plan for both chefs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen.codes import CELLS, CHEF, DELIVERIES, HELD, OUT_SIZE, POT_TICKS, STAY
from galley.kitchen.layout import Layout
from galley.kitchen.rules.tick import step
from galley.kitchen.trajectory import start
from galley.planning.robots import QMDP
from galley.planning.team import TeamPlan, TeamPlanner, TeamSearch

WIDTH_AHEAD = 36
"""Nodes kept per tick in the search for the next plan."""
PAIRS_AHEAD = 10
"""Pairs of subtasks tried from each."""
TICKS_AHEAD = 200
"""The length of the longest next plan."""
LEAD_TICKS = 24
"""Ticks over which the search for the next plan is spread, at least."""
NODES_PER_TICK = 165
"""Nodes of it in a tick, at most: what a decision may take."""
TRIAL_TICKS = 2
"""Ticks for which a quick plan has to be followed before a better one is searched for."""
WIDTH_QUICK = 4
"""The same for the plan that is there at once: at the start, and when the world is not as planned."""
PAIRS_QUICK = 8
ORDERS_QUICK = 1
NODES_QUICK = 400
PATIENCE_TICKS = 12
"""Ticks without anything taken, put or served, since a plan broke, after which the agent goes on alone."""
BROKEN_PLANS = 6
"""Plans broken since the last soup after which it does so as well."""


class Centralized:
    """An agent that plays its part in a plan for both chefs, trusting the other to play theirs.

    A plan is carried out open-loop. Meanwhile, a little in each tick, the next one is searched for, from a
    state to which this one leads: where a soup is served, sooner if this is a quick plan. When the world is
    not as planned, a quick plan is made from there at once. An agent that is let down again and again goes on
    as the QMDP robot does until a soup is served; the next time until two are, then four, and so on.

    Everything is a function of layout, seat, seed and what was observed. Two such agents have one plan, as
    only what an agent does alone depends on its seat.

    Source: Fontaine et al. 2021 (RSS), Sec. IV "Centralized Planning". Ours: planning ahead, going on alone.
    """

    def __init__(self) -> None:
        self._planner: TeamPlanner | None = None
        self._alone = QMDP()

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode with a quick plan; the seed settles random moves of an agent on its own.

        Raises:
            GalleyError: the layout cannot be served (the message names the station) or is too large.
        """
        if self._planner is None or layout != self._planner.layout:
            self._planner = TeamPlanner(layout)
            self._quick = self._planner.search(WIDTH_QUICK, PAIRS_QUICK)
            self._ahead = self._planner.search(WIDTH_AHEAD, PAIRS_AHEAD, TICKS_AHEAD)
        self._seat = seat
        self._alone.reset(layout, seat, seed)
        self._alone.act(start(layout), 0)  # its kernels are fetched now, not in the middle of a round
        self._vain_ticks, self._broken = 0, 0
        self._soups_alone, self._alone_until = 1, 0
        self._out = np.zeros(OUT_SIZE, dtype=np.int32)
        self._take_up_quick(start(layout))

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """This seat's part in the plan's next joint action; to stay when no plan leads on."""
        self._ready()
        if self._is_alone(state):
            return self._alone.act(state, tick)
        plan, at = self._plan, self._at
        if not _holds(plan, at, state):  # not what followed from what was observed
            plan, at = _made_at_once(self._quick, state), 0
        return int(plan.joint_actions[at, self._seat]) if at < len(plan.joint_actions) else STAY

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Move on in the plan, or make another where what both did is not as planned."""
        layout = self._ready().layout
        after = state.copy()
        step(layout.spec, after, *joint_action, self._out)
        self._alone.observe(state, joint_action)
        if self._is_alone(state):
            if not self._is_alone(after):
                self._take_up_quick(after)
            return
        if not _holds(self._plan, self._at, state):
            self._take_up_quick(state)
        self._at += 1
        holds = _holds(self._plan, self._at, after)
        if after[DELIVERIES] > state[DELIVERIES]:
            self._broken = 0
        self._broken += not holds
        if not np.array_equal(_made(state), _made(after)):
            self._vain_ticks = 0
        elif self._vain_ticks > 0 or not holds:
            self._vain_ticks += 1
        if self._vain_ticks >= PATIENCE_TICKS or self._broken >= BROKEN_PLANS:
            self._alone_until = int(after[DELIVERIES]) + self._soups_alone
            self._soups_alone *= 2
            self._vain_ticks, self._broken = 0, 0
        elif not holds:
            self._take_up_quick(after)
        else:
            self._plan_ahead(after)

    def _is_alone(self, state: NDArray[np.int16]) -> bool:
        return bool(state[DELIVERIES] < self._alone_until)

    def _take_up_quick(self, state: NDArray[np.int16]) -> None:
        self._plan, self._at = _made_at_once(self._quick, state), 0
        self._next_at = min(TRIAL_TICKS + LEAD_TICKS, len(self._plan.joint_actions))
        self._begin_at = TRIAL_TICKS if self._next_at > TRIAL_TICKS else self._next_at

    def _plan_ahead(self, state: NDArray[np.int16]) -> None:
        """Work on the next plan, and take it up if it is due in `state`."""
        if self._at == self._next_at:
            plan = self._ahead.plan() if self._begin_at < self._next_at else None
            served = [] if plan is None else plan.served_at
            if plan is None or not served:
                self._take_up_quick(state)
                return
            self._plan, self._at, self._begin_at = plan, 0, 0
            self._next_at = next((at for at in served if at >= LEAD_TICKS), len(plan.joint_actions))
        if self._at == self._begin_at:
            nodes = NODES_PER_TICK * (self._next_at - self._at)
            self._ahead.begin(self._plan.states[self._next_at], most_nodes=nodes)
        if self._at >= self._begin_at:
            self._ahead.go_on(NODES_PER_TICK)

    def _ready(self) -> TeamPlanner:
        if self._planner is None:
            raise GalleyError("the agent has no layout yet; call reset first")
        return self._planner


def _made_at_once(search: TeamSearch, state: NDArray[np.int16]) -> TeamPlan:
    search.begin(state, ORDERS_QUICK, NODES_QUICK)
    return search.plan()


def _holds(plan: TeamPlan, at: int, state: NDArray[np.int16]) -> bool:
    return at < len(plan.states) and np.array_equal(plan.states[at], state)


def _made(state: NDArray[np.int16]) -> NDArray[np.int16]:
    """int16[3 + H*W]: what is held, soups served, what lies about and is in pots, cooking times left out."""
    made = np.empty(3 + state.size - CELLS, dtype=np.int16)
    made[:3] = state[HELD], state[CHEF + HELD], state[DELIVERIES]
    made[3:] = state[CELLS:] % POT_TICKS
    return made
