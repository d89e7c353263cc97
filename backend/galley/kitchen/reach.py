"""Which cells and stations chefs can get to."""

from __future__ import annotations

from galley.kitchen.codes import FLOOR
from galley.kitchen.layout import Layout, Place

STEPS: tuple[Place, ...] = ((0, -1), (0, 1), (1, 0), (-1, 0))
"""(dx, dy) of the four facings."""


def reachable_floor(layout: Layout, start: Place) -> frozenset[Place]:
    """The floor cells that a chef who is alone can walk to from `start`."""
    seen = {start}
    edge = [start]
    while edge:
        x, y = edge.pop()
        for dx, dy in STEPS:
            place = (x + dx, y + dy)
            if place not in seen and layout.tiles[place[1], place[0]] == FLOOR:
                seen.add(place)
                edge.append(place)
    return frozenset(seen)


def reachable_stations(layout: Layout) -> tuple[frozenset[Place], frozenset[Place]]:
    """For each seat, the cells that are not floor and that its chef can stand beside."""
    found = []
    for start in layout.starts:
        beside = {
            (x + dx, y + dy) for x, y in reachable_floor(layout, start) for dx, dy in STEPS
        }  # every edge is closed, so no neighbour lies outside
        found.append(frozenset(p for p in beside if layout.tiles[p[1], p[0]] != FLOOR))
    return found[0], found[1]
