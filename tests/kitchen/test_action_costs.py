"""Fewest actions to face a tile, and what chefs can reach, on random and drawn kitchens."""

from __future__ import annotations

import numpy as np
from hypothesis import given

from galley.kitchen import Layout
from galley.kitchen.action_costs import UNREACHABLE, action_costs
from galley.kitchen.reach import reachable_floor, reachable_stations
from tests.kitchen.reference_2019 import actions_to_face
from tests.kitchen.strategies import layouts


@given(layouts())
def test_costs_equal_a_plain_search(layout: Layout) -> None:
    targets = [*layout.pots, *layout.onions, *layout.servings][:4]
    costs = action_costs(layout, np.array([layout.cell(place) for place in targets], dtype=np.int64))
    for x, y in layout.floor[:6]:
        for facing in range(4):
            for column, target in enumerate(targets):
                expected = actions_to_face(layout, (x, y, facing), target)
                found = costs[layout.cell((x, y)) * 4 + facing, column]
                assert found == (UNREACHABLE if expected is None else expected)


def test_reach_ends_at_counters() -> None:
    forced = Layout.from_ascii("forced", "XXXPX\nO X1P\nO2X X\nD X X\nXXXSX")
    assert reachable_floor(forced, (3, 1)) == {(3, 1), (3, 2), (3, 3)}
    first, second = reachable_stations(forced)
    assert {place for place in first if forced.tiles[place[1], place[0]] != 1} == {(3, 0), (4, 1), (3, 4)}
    assert {place for place in second if forced.tiles[place[1], place[0]] != 1} == {(0, 1), (0, 2), (0, 3)}
