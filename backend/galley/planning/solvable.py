"""Whether two chefs can cook and serve in a layout at all."""

from __future__ import annotations

from galley.errors import GalleyError
from galley.kitchen.codes import (
    COUNTER,
    DISH_DISPENSER,
    ONION_DISPENSER,
    POT,
    SERVING,
    STATIONS,
    TOMATO_DISPENSER,
)
from galley.planning.distances import Distances


def require_solvable(known: Distances) -> None:
    """Make sure that every soup that may be ordered can be made and served by the two chefs together.

    Raises:
        GalleyError: some station is missing or out of reach, or what one chef has cannot get to the other;
            the message names layout and station.
    """
    layout = known.layout
    tiles = layout.tiles.ravel()
    kinds = {
        "onion": ONION_DISPENSER,
        "tomato": TOMATO_DISPENSER,
    }
    ordered = layout.rules.orders or tuple(
        kind for kind, tile in kinds.items() if (known.reachable & (tiles == tile)).any()
    )
    ingredients = sorted({kinds[kind] for kind in ordered}) or [ONION_DISPENSER]
    for station in (POT, *ingredients, DISH_DISPENSER, SERVING):
        there = tiles == station
        if not there.any():
            raise GalleyError(
                f"layout {layout.name!r} has no {STATIONS[station]}; add one that a chef can reach"
            )
        if not (known.reachable & there).any():
            where = layout.place(int(there.argmax()))
            raise GalleyError(
                f"layout {layout.name!r}: no chef can reach the {STATIONS[station]} at {where}; "
                "clear a way to it"
            )
    if (known.reachable.all(axis=0) & (tiles == COUNTER)).any():
        return

    def reaches(seat: int, station: int) -> bool:
        return bool((known.reachable[seat] & (tiles == station)).any())

    servers = [seat for seat in (0, 1) if reaches(seat, DISH_DISPENSER) and reaches(seat, SERVING)]
    for ingredient in ingredients:
        cooks = [seat for seat in (0, 1) if reaches(seat, ingredient)]
        pots = tiles == POT
        both = (
            known.reachable[cook] & known.reachable[server] & pots for cook in cooks for server in servers
        )
        if not any(pot.any() for pot in both):
            lacking = DISH_DISPENSER if not servers else POT
            raise GalleyError(
                f"layout {layout.name!r}: the chefs stand apart and share no counter, so no chef can "
                f"reach the {STATIONS[lacking]} with what it needs there; open a counter between them"
            )
