"""Distances against a plain search over poses, and by hand."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from hypothesis import given

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.kitchen.codes import FLOOR
from galley.planning.distances import distances
from tests.planning.layouts import FORCED, layouts

STEPS = ((0, -1), (0, 1), (1, 0), (-1, 0))


def searched(layout: Layout, x: int, y: int, facing: int, target: tuple[int, int]) -> int:
    """Fewest actions by trying them all, -1 if there is no way."""
    edge = deque([((x, y, facing), 0)])
    seen = {(x, y, facing)}
    while edge:
        (x, y, facing), cost = edge.popleft()
        if (x + STEPS[facing][0], y + STEPS[facing][1]) == target:
            return cost
        for move, (dx, dy) in enumerate(STEPS):
            goes = layout.tiles[y + dy, x + dx] == FLOOR
            pose = (x + dx, y + dy, move) if goes else (x, y, move)
            if pose not in seen:
                seen.add(pose)
                edge.append((pose, cost + 1))
    return -1


@given(layouts())
def test_distances_are_those_of_a_plain_search(layout: Layout) -> None:
    found = distances(layout)
    stations = [layout.place(int(cell)) for cell in np.flatnonzero(layout.tiles.ravel() != FLOOR)]
    for x, y in layout.floor[:3]:
        for target in stations[:: max(1, len(stations) // 5)]:
            cost = found.costs[layout.cell((x, y)) * 4 + 2, layout.cell(target)]
            assert cost == searched(layout, x, y, 2, target)


def test_turning_costs_an_action() -> None:
    layout = Layout.from_ascii("room", "XXPXX\nO  2O\nX1  X\nXDXSX")
    costs = distances(layout).costs
    pot, pose = layout.cell((2, 0)), layout.cell((2, 1)) * 4
    assert costs[pose : pose + 4, pot].tolist() == [0, 1, 1, 1]


def test_each_seat_reaches_its_side_and_the_shared_counters() -> None:
    left = distances(FORCED).reachable[1]
    right = distances(FORCED).reachable[0]
    shared = {FORCED.place(int(cell)) for cell in np.flatnonzero(left & right)}
    assert shared == {(2, 1), (2, 2), (2, 3)}
    assert not any(right[FORCED.cell(place)] for place in (*FORCED.onions, *FORCED.dishes))
    assert not any(left[FORCED.cell(place)] for place in (*FORCED.pots, *FORCED.servings))


def test_a_hall_is_too_large() -> None:
    rows = ["X" * 50, "X12" + " " * 46 + "X", *["X" + " " * 48 + "X"] * 40, "X" * 50]
    with pytest.raises(GalleyError, match="2150 cells"):
        distances(Layout("hall", tuple(rows)))
