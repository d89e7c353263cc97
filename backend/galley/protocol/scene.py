"""What the browser is shown of a kitchen: its state and its changes as the lists that messages carry."""

from __future__ import annotations

from collections.abc import Iterable
from operator import ne
from typing import Any

from numpy import int16
from numpy.typing import NDArray

from galley.kitchen import Event, Layout
from galley.kitchen.codes import (
    CELL,
    CELLS,
    CHEF,
    DELIVERIES,
    FACING,
    HELD,
    ORDERS_DELIVERED,
)
from galley.kitchen.state import points, pot_view
from galley.protocol.messages import KitchenChanges, WholeKitchen

State = NDArray[int16]


class Scene:
    """One layout's kitchens as seen by the browser; holds nothing that changes but what it has worked out."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.grid = [row.replace("1", " ").replace("2", " ") for row in layout.grid]
        self._pots = {layout.cell(place) for place in layout.pots}
        self._counters = [layout.cell(place) for place in layout.counters]
        self._contents: dict[int, tuple[int, int, int, bool]] = {}
        self._places = [layout.place(cell) for cell in range(layout.tiles.size)]

    def chefs(self, state: State) -> list[list[int]]:
        """Seat 0 and seat 1 as [x, y, facing, held]."""
        return self._chefs(state[: 2 * CHEF].tolist())

    def whole(self, state: State, score_before: int = 0) -> WholeKitchen:
        """The parts of a keyframe that the state decides, orders included.

        `score_before` are the points of earlier episodes.
        """
        row = state.tolist()
        cells = row[CELLS:]
        orders = self.layout.rules.orders
        return {
            "chefs": self._chefs(row),
            "things": [self._thing(cell, cells[cell]) for cell in self._counters if cells[cell]],
            "pots": [self._pot(cell, cells[cell]) for cell in sorted(self._pots)],
            "score": score_before + points(self.layout, row[DELIVERIES]),
            "orders": None if orders is None else list(orders[row[ORDERS_DELIVERED] :]),
        }

    def changes(self, before: State, after: State, score_before: int = 0) -> KitchenChanges:
        """The parts of a tick message that the states around it decide; `score_before` as in `whole`."""
        things: list[list[int]] = []
        pots: list[list[int | bool]] = []
        # As lists, for rows this short are read sooner than arrays are.
        old, new = before.tolist(), after.tolist()
        cells = new[CELLS:]
        for cell, changed in enumerate(map(ne, old[CELLS:], cells)):
            if changed and cell in self._pots:
                pots.append(self._pot(cell, cells[cell]))
            elif changed:
                things.append(self._thing(cell, cells[cell]))
        score = score_before + points(self.layout, new[DELIVERIES])
        return {"chefs": self._chefs(new), "things": things, "pots": pots, "score": score}

    def _chefs(self, row: list[int]) -> list[list[int]]:
        return [[*self._places[row[at + CELL]], row[at + FACING], row[at + HELD]] for at in (0, CHEF)]

    def _thing(self, cell: int, thing: int) -> list[int]:
        return [*self._places[cell], thing]

    def _pot(self, cell: int, packed: int) -> list[int | bool]:
        contents = self._contents.get(packed)
        if contents is None:  # a pot has some seventy contents, told at every tick that it cooks
            pot = pot_view(self.layout, packed)
            contents = self._contents[packed] = (pot.onions, pot.tomatoes, pot.ticks, pot.ready)
        return [*self._places[cell], *contents]


def event_rows(events: Iterable[Event]) -> list[list[Any]]:
    """Events as [kind, seat, thing, place, x, y]."""
    return [[event.kind, event.seat, event.thing, event.place, event.x, event.y] for event in events]
