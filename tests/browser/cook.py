"""A participant in a round: sees what the server sent and no more, thinks like the myopic human model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from galley.agents.protocol import Agent
from galley.kitchen.layout import Layout
from galley.kitchen.state import ChefView, KitchenView, PotView, from_view

KEYS = ("ArrowUp", "ArrowDown", "ArrowRight", "ArrowLeft", None, "Space")
"""The key of each action code; staying needs none."""


class Cook:
    """Follows the frames of a round and names the next key."""

    def __init__(self, agent: Agent, keyframe: dict[str, Any]) -> None:
        rows = [list(row) for row in keyframe["grid"]]
        for sign, (x, y, *_) in zip("12", keyframe["chefs"], strict=True):
            rows[y][x] = sign
        drawn = "\n".join("".join(row) for row in rows)
        self.layout = Layout.from_ascii("seen", drawn, cook_time_ticks=keyframe["cook_time"])
        self.horizon: int = keyframe["horizon"]
        self._agent = agent
        self._things: dict[tuple[int, int], int] = {}
        self._pots: dict[tuple[int, int], PotView] = {}
        self._agent.reset(self.layout, keyframe["seat"], seed=1)
        self.see(keyframe)

    def see(self, frame: dict[str, Any]) -> None:
        """Take a keyframe or the changes of a tick in."""
        self.tick: int = frame["tick"]
        self._chefs: Sequence[list[int]] = frame["chefs"]
        self._things.update({(x, y): thing for x, y, thing in frame["things"]})
        for x, y, onions, tomatoes, ticks, ready in frame["pots"]:
            self._pots[x, y] = PotView(onions, tomatoes, ticks, bool(ready))

    def next_key(self) -> str | None:
        """The key to press for the next tick, or None to wait."""
        first, second = (ChefView(*chef) for chef in self._chefs)
        lying = {place: thing for place, thing in self._things.items() if thing}
        state = from_view(self.layout, KitchenView((first, second), lying, self._pots, self.tick))
        action = self._agent.act(state, self.tick)
        self._agent.observe(state, (action, action))
        return KEYS[action]
