"""The kitchen as a participant sees it: rebuilt from the frames of a round, and what to do in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from galley.agents.protocol import Agent
from galley.kitchen import EAST, INTERACT, NORTH, SOUTH, STAY, THINGS, WEST, Layout
from galley.kitchen.state import ChefView, KitchenView, PotView, from_view

KEY_OF: Final[Mapping[int, str]] = {
    NORTH: "up",
    SOUTH: "down",
    EAST: "right",
    WEST: "left",
    INTERACT: "interact",
}
"""The key of each action; staying needs none."""

MakeAgent = Callable[[Layout], Agent]


class Seen:
    """Follows the frames of one episode and asks an agent what it would do.

    `make` gives the agent for a layout; `layouts` are those known by name, so that agents made for certain
    layouts know where they are.
    """

    def __init__(
        self, keyframe: Mapping[str, Any], make: MakeAgent, layouts: Mapping[str, Layout], seed: int
    ) -> None:
        self.seat: int = keyframe["seat"]
        self.episode: int = keyframe["episode"]
        self.layout = _layout(keyframe, layouts)
        self._orders = self.layout.rules.orders or ()
        self._delivered = 0
        self._things: dict[tuple[int, int], int] = {}
        self._pots: dict[tuple[int, int], PotView] = {}
        self._agent = make(self.layout)
        self._agent.reset(self.layout, self.seat, seed)
        self._state: NDArray[np.int16] | None = None
        self._take(keyframe)

    def see(self, frame: Mapping[str, Any]) -> None:
        """Take in what a tick changed, and let the agent take note of what both chefs did."""
        before, was = self.state(), self._chefs
        self._take(frame)
        for _kind, *about in (event for event in frame.get("events", ()) if event[0] == "delivery"):
            thing = about[1]
            words = THINGS[thing] if isinstance(thing, int) else str(thing)
            if self._delivered < len(self._orders) and words.startswith(self._orders[self._delivered]):
                self._delivered += 1
        did = [_did(tuple(old), tuple(new)) for old, new in zip(was, self._chefs, strict=True)]
        self._agent.observe(before, (did[0], did[1]))

    def look_again(self, keyframe: Mapping[str, Any]) -> None:
        """Take in a picture of the whole, after a pause or a gap."""
        self._things.clear()
        self._pots.clear()
        self._take(keyframe)

    @property
    def chef(self) -> tuple[int, ...]:
        """The own chef as (x, y, facing, held)."""
        return tuple(self._chefs[self.seat])

    @property
    def facing(self) -> str:
        """The key of the way that the own chef faces."""
        return KEY_OF[self.chef[2]]

    def state(self) -> NDArray[np.int16]:
        """The kitchen's state, as far as it can be seen."""
        if self._state is None:
            first, second = (ChefView(*chef) for chef in self._chefs)
            lying = {place: thing for place, thing in self._things.items() if thing}
            seen = KitchenView((first, second), lying, self._pots, self.tick, self._delivered)
            self._state = from_view(self.layout, seen)
        return self._state

    def decide(self) -> str | None:
        """The key that the agent would press now; None to wait."""
        return KEY_OF.get(self._agent.act(self.state(), self.tick))

    def _take(self, frame: Mapping[str, Any]) -> None:
        self._state = None
        self.tick: int = frame["tick"]
        self._chefs: list[list[int]] = frame["chefs"]
        self._things.update({(x, y): thing for x, y, thing in frame["things"]})
        self._pots.update(
            {
                (x, y): PotView(onions, tomatoes, ticks, bool(ready))
                for x, y, onions, tomatoes, ticks, ready in frame["pots"]
            }
        )


def _layout(keyframe: Mapping[str, Any], layouts: Mapping[str, Layout]) -> Layout:
    """The layout of a round: a known one with that map, else one drawn from the frame."""
    orders = keyframe["orders"]
    rules = {
        "cook_time_ticks": keyframe["cook_time"],
        "horizon_ticks": keyframe["horizon"],
        "orders": tuple(orders) if orders else None,
    }
    floor = str.maketrans("12", "  ")
    shown = tuple(row.ljust(len(keyframe["grid"][0])) for row in keyframe["grid"])
    for layout in layouts.values():
        if tuple(row.translate(floor) for row in layout.grid) == shown:
            return layout.with_rules(**rules)
    rows = [list(row) for row in shown]
    for sign, (x, y, *_) in zip("12", keyframe["chefs"], strict=True):
        rows[y][x] = sign
    return Layout("seen", tuple("".join(row) for row in rows)).with_rules(**rules)


def _did(old: tuple[int, ...], new: tuple[int, ...]) -> int:
    """The action that best explains how a chef changed in one tick."""
    if old[:2] != new[:2] or old[2] != new[2]:
        return new[2]
    return STAY if old[3] == new[3] else INTERACT
