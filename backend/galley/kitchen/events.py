"""What happened in a tick, as named events: one table for code, docs and records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from galley.kitchen.codes import (
    BIT_BLOCKED,
    BIT_DELIVER,
    BIT_FETCH,
    BIT_PAID,
    BIT_PICK_UP,
    BIT_POT,
    BIT_PUT_DOWN,
    BIT_TAKE,
    CELL,
    CELLS,
    CHEF,
    COUNTER,
    FACING,
    FLOOR,
    ONION,
    ONION_SOUP,
    OUT_EVENTS,
    OUT_READY,
    POT,
    SERVING,
    SPEC_PRICES,
    THINGS,
    TICK,
)
from galley.kitchen.layout import Layout
from galley.kitchen.pots import recipe_in, recipe_of_thing, thing_of
from galley.kitchen.reach import STEPS

EVENTS: Final[dict[str, str]] = {
    "pick_up": "A chef takes a thing from a dispenser, a counter or (a finished soup, with a dish) a pot.",
    "put_down": "A chef puts the held thing on an empty counter.",
    "potting": "A chef puts an ingredient into a pot.",
    "soup_ready": "A pot's soup has cooked for the full time; no seat.",
    "delivery": "A chef delivers a soup; reward is 0 when it did not match the first order.",
    "blocked": "A move leaves the chef in its cell; place is what was in the way (floor: the other chef).",
}
"""Every kind of event, with its meaning."""

PLACES: Final = ("dispenser", "counter", "pot", "serving", "floor")

_PLACE_OF_TILE: Final = {FLOOR: "floor", COUNTER: "counter", POT: "pot", SERVING: "serving"}

# First bit, number of bits, code of the first bit's thing, kind, place.
_GROUPS: Final = (
    (BIT_TAKE, 3, ONION, "pick_up", "dispenser"),
    (BIT_PICK_UP, 5, ONION, "pick_up", "counter"),
    (BIT_FETCH, 2, ONION_SOUP, "pick_up", "pot"),
    (BIT_PUT_DOWN, 5, ONION, "put_down", "counter"),
    (BIT_POT, 2, ONION, "potting", "pot"),
    (BIT_DELIVER, 2, ONION_SOUP, "delivery", "serving"),
)


@dataclass(frozen=True)
class Event:
    """One happening at cell (x, y): `tick` counts from 0, `seat` is None for a pot's own."""

    tick: int
    seat: int | None
    kind: str
    thing: str
    place: str
    x: int
    y: int
    reward: int = 0


def decode(
    layout: Layout, before: NDArray[np.int16], after: NDArray[np.int16], out: NDArray[np.int32]
) -> tuple[Event, ...]:
    """The events of one tick: seat 0's, seat 1's, then the pots'.

    `before` and `after` are the states int16[S] around the tick, `out` int32[OUT_SIZE] what it wrote.
    """
    written = out.tolist()
    if not any(written[OUT_EVENTS:]):
        return ()
    tick = int(before[TICK])
    events = []
    for seat in (0, 1):
        mask = written[OUT_EVENTS + seat]
        if not mask:
            continue
        facing = int(after[CHEF * seat + FACING])
        x, y = layout.place(int(before[CHEF * seat + CELL]))
        dx, dy = STEPS[facing]
        x, y = x + dx, y + dy
        if mask >> BIT_BLOCKED & 1:
            place = _PLACE_OF_TILE.get(int(layout.tiles[y, x]), "dispenser")
            events.append(Event(tick, seat, "blocked", "", place, x, y))
        for first, bits, thing, kind, place in _GROUPS:
            group = mask >> first & ((1 << bits) - 1)
            if group:
                thing += group.bit_length() - 1
                paid = kind == "delivery" and mask >> BIT_PAID & 1
                reward = int(layout.spec[SPEC_PRICES + recipe_of_thing(thing)]) if paid else 0
                events.append(Event(tick, seat, kind, THINGS[thing], place, x, y, reward))
    ready = written[OUT_READY]
    for number, place_ in enumerate(layout.pots):
        if ready >> number & 1:
            soup = THINGS[thing_of(recipe_in(int(after[CELLS + layout.cell(place_)])))]
            events.append(Event(tick, None, "soup_ready", soup, "pot", *place_))
    return tuple(events)
