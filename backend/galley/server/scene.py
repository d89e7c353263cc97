"""What the browser is shown of a kitchen: its state and its changes as the lists that the wire carries."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from galley.kitchen import Event, Layout
from galley.kitchen.codes import (
    CELL,
    CELLS,
    CHEF,
    DELIVERIES,
    FACING,
    HELD,
    INGREDIENTS_PER_SOUP,
    ORDERS_DELIVERED,
)
from galley.kitchen.state import unpack_pot

State = NDArray[np.int16]


class Scene:
    """One layout's kitchens as seen by the browser; holds nothing that changes."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.grid = [row.replace("1", " ").replace("2", " ") for row in layout.grid]
        self._pots = {layout.cell(place) for place in layout.pots}
        self._counters = [layout.cell(place) for place in layout.counters]

    def chefs(self, state: State) -> list[list[int]]:
        """Seat 0 and seat 1 as [x, y, facing, held]."""
        row = state[: 2 * CHEF].tolist()
        return [[*self.layout.place(row[at + CELL]), row[at + FACING], row[at + HELD]] for at in (0, CHEF)]

    def whole(self, state: State, score_before: int = 0) -> dict[str, Any]:
        """The parts of a keyframe that the state decides, orders included.

        `score_before` are the points of earlier episodes.
        """
        cells = state[CELLS:].tolist()
        orders = self.layout.rules.orders
        return {
            "chefs": self.chefs(state),
            "things": [self._thing(cell, cells[cell]) for cell in self._counters if cells[cell]],
            "pots": [self._pot(cell, cells[cell]) for cell in sorted(self._pots)],
            "score": score_before + self.score(state),
            "orders": None if orders is None else list(orders[int(state[ORDERS_DELIVERED]) :]),
        }

    def changes(self, before: State, after: State, score_before: int = 0) -> dict[str, Any]:
        """The parts of a tick message that the states around it decide; `score_before` as in `whole`."""
        things: list[list[int]] = []
        pots: list[list[int | bool]] = []
        for cell in np.flatnonzero(before[CELLS:] != after[CELLS:]).tolist():
            value = int(after[CELLS + cell])
            if cell in self._pots:
                pots.append(self._pot(cell, value))
            else:
                things.append(self._thing(cell, value))
        score = score_before + self.score(after)
        return {"chefs": self.chefs(after), "things": things, "pots": pots, "score": score}

    def score(self, state: State) -> int:
        """Points so far."""
        return int(state[DELIVERIES]) * self.layout.rules.delivery_reward

    def _thing(self, cell: int, thing: int) -> list[int]:
        return [*self.layout.place(cell), thing]

    def _pot(self, cell: int, packed: int) -> list[int | bool]:
        kind, count, ticks = unpack_pot(packed)
        ready = count == INGREDIENTS_PER_SOUP and ticks >= self.layout.rules.cook_time_ticks
        return [*self.layout.place(cell), kind, count, ticks, ready]


def happenings(events: Iterable[Event]) -> list[list[Any]]:
    """Events as [kind, seat, thing, place, x, y]."""
    return [[event.kind, event.seat, event.thing, event.place, event.x, event.y] for event in events]
