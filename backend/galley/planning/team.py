"""One plan for both chefs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen.codes import DELIVERIES, ORDERS_DELIVERED, OUT_SIZE
from galley.kitchen.layout import Layout
from galley.kitchen.rules.tick import step
from galley.kitchen.state import state_size
from galley.planning.brain import brain
from galley.planning.kernels.robot_kernel import Brain
from galley.planning.kernels.team_kernel import (
    BEST_END,
    BEST_NODE,
    LEG_TICKS,
    PROGRESS,
    Search,
    begin_search,
    search_on,
)

ORDERS_AHEAD = 3
"""Orders planned for at a time when there is no order list."""
BEYOND = 3
"""Orders after those whose likely cost counts, so that a plan leaves the kitchen prepared."""
WIDTH = 64
"""Nodes kept per tick."""
PAIRS = 16
"""Pairs of subtasks tried from each node."""
WIDTH_SMALL = 100
"""Nodes kept per tick in a kitchen of at most `SMALL` floor cells, which is searched thoroughly."""
PAIRS_SMALL = 30
SMALL = 12
MOST_TICKS = 300
"""The length of the longest plan searched for."""
ALL = 1 << 40
"""More nodes than any search has."""


@dataclass(frozen=True, eq=False)
class TeamPlan:
    """Joint actions uint8[T, 2] and the states int16[T + 1, S] they lead through.

    `complete` is False when the search reached its limit before the orders were served; the plan
    then leads to the most promising state found.
    """

    joint_actions: NDArray[np.uint8]
    states: NDArray[np.int16]
    complete: bool

    @property
    def served_at(self) -> list[int]:
        """The places in `states` at which a soup has just been served."""
        served: list[int] = (np.flatnonzero(np.diff(self.states[:, DELIVERIES])) + 1).tolist()
        return served


class TeamSearch:
    """A search for a joint plan that is carried on a little at a time: `begin`, `go_on`, `plan`.

    It keeps `width` nodes a tick for up to `most_ticks`, and tries `pairs` pairs of subtasks from each.
    """

    def __init__(
        self, layout: Layout, known: Brain, width: int, pairs: int, most_ticks: int, thorough: bool
    ) -> None:
        self.layout = layout
        self._brain, self._pairs, self._thorough = known, pairs, thorough
        nodes = width * most_ticks
        keys = 1 << min(20, (nodes * PAIRS).bit_length())
        self._search = Search(
            states=np.zeros((nodes, state_size(layout)), dtype=np.int16),
            parents=np.zeros(nodes, dtype=np.int32),
            legs=np.zeros((nodes, LEG_TICKS, 2), dtype=np.uint8),
            lengths=np.zeros(nodes, dtype=np.int16),
            totals=np.zeros(nodes, dtype=np.float32),
            counts=np.zeros(most_ticks, dtype=np.int32),
            keys=np.zeros(keys, dtype=np.uint64),
            times=np.zeros(keys, dtype=np.int16),
            progress=np.zeros(PROGRESS, dtype=np.int64),
            least=np.zeros(1, dtype=np.float64),
        )

    def begin(self, state: NDArray[np.int16], orders: int | None = None, most_nodes: int = ALL) -> None:
        """Make ready for the plan from `state` (int16[S]) until `orders` more soups are served.

        Without `orders` it is `ORDERS_AHEAD`; never more than what is left of an order list. The orders after
        them count by their likely cost. The search ends at the latest after `most_nodes`.
        """
        listed = self.layout.rules.orders
        left = None if listed is None else len(listed) - int(state[ORDERS_DELIVERED])
        known = ORDERS_AHEAD + BEYOND if left is None else left
        wanted = min(known, ORDERS_AHEAD) if orders is None else orders
        beyond = max(0, min(BEYOND, known - wanted))
        begin_search(self._search, state, wanted, beyond, self._pairs, self._thorough, most_nodes)

    def go_on(self, work: int) -> bool:
        """Whether the search is done after that much more work, counted in nodes."""
        return bool(search_on(self._brain, self._search, work))

    def plan(self) -> TeamPlan:
        """The plan found, when the search is done; what is left of it is done first."""
        self.go_on(ALL)
        search = self._search
        end = int(search.progress[BEST_END])
        node = end if end >= 0 else int(search.progress[BEST_NODE])
        legs = []
        while search.parents[node] >= 0:
            legs.append(search.legs[node, : search.lengths[node]])
            node = int(search.parents[node])
        actions = np.concatenate([*legs[::-1], np.empty((0, 2), dtype=np.uint8)])
        states = np.empty((len(actions) + 1, search.states.shape[1]), dtype=np.int16)
        states[0] = search.states[0]
        out = np.zeros(OUT_SIZE, dtype=np.int32)
        for tick, (act0, act1) in enumerate(actions.tolist()):
            states[tick + 1] = states[tick]
            step(self.layout.spec, states[tick + 1], act0, act1, out)
        return TeamPlan(actions, states, end >= 0)


class TeamPlanner:
    """Near-optimal joint plans on one layout, by A* over pairs of subtasks with joint motion costs.

    Raises:
        GalleyError: the layout cannot be served (the message names the station) or is too large.
    """

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._brain = brain(layout, 0, team=True)
        self._searches: dict[tuple[int, int, int], TeamSearch] = {}

    def search(
        self, width: int | None = None, pairs: int | None = None, most_ticks: int = MOST_TICKS
    ) -> TeamSearch:
        """A search to carry on step by step; by default a thorough one in a small kitchen."""
        thorough = width is None and len(self.layout.floor) <= SMALL
        if width is None:
            width = WIDTH_SMALL if thorough else WIDTH
        if pairs is None:
            pairs = PAIRS_SMALL if thorough else PAIRS
        return TeamSearch(self.layout, self._brain, width, pairs, most_ticks, thorough)

    def plan(
        self,
        state: NDArray[np.int16],
        orders: int | None = None,
        width: int | None = None,
        pairs: int | None = None,
        most_ticks: int = MOST_TICKS,
    ) -> TeamPlan:
        """The plan from `state` (int16[S]) for `orders` more soups, see `TeamSearch`.

        Raises:
            GalleyError: less than one order or tick is asked for.
        """
        if (orders is not None and orders < 1) or (width is not None and width < 1) or most_ticks < 1:
            raise GalleyError("a plan needs at least one order, one node a tick and one tick")
        key = (width or 0, pairs or 0, most_ticks)
        if key not in self._searches:
            self._searches[key] = self.search(width, pairs, most_ticks)
        search = self._searches[key]
        search.begin(state, orders)
        return search.plan()
