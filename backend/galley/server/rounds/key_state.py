"""What a participant's keys mean at each tick: a pure state machine without a clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from galley.kitchen import EAST, INTERACT, NORTH, SOUTH, STAY, WEST

ACTION_OF_KEY: Mapping[str, int] = {
    "up": NORTH,
    "down": SOUTH,
    "left": WEST,
    "right": EAST,
    "interact": INTERACT,
}
MAX_WAITING = 4


@dataclass(slots=True)
class _Press:
    """A press that has not acted yet."""

    key: str
    held: bool = True


class KeyState:
    """The keys of one chef: `press` and `let_go` as they happen, `take` once a tick.

    Every press acts at least once, in the order pressed, also when it was shorter than a tick. Interact acts
    once a press however long it is held. A held direction repeats each tick; of several the latest pressed
    wins. At most MAX_WAITING presses wait for their tick; more are forgotten, so that hammering a key cannot
    run ahead. Without `repeats` directions are as interact: each press acts once.
    """

    def __init__(self, *, repeats: bool = True) -> None:
        self._repeats = repeats
        self._down: set[str] = set()
        self._held: list[str] = []
        self._waiting: list[_Press] = []

    def press(self, key: str) -> bool:
        """Whether a key going down changed anything: it does not when the key is down already."""
        if key in self._down:
            return False
        self._down.add(key)
        if key != "interact":
            self._held.append(key)
        if len(self._waiting) < MAX_WAITING:
            self._waiting.append(_Press(key))
        return True

    def let_go(self, key: str) -> bool:
        """Whether a key going up changed anything: it does not when the key is up already."""
        if key not in self._down:
            return False
        self._down.remove(key)
        if key != "interact":
            self._held.remove(key)
        for press in self._waiting:
            if press.key == key:
                press.held = False
        return True

    def let_go_all(self) -> None:
        """Let go of every key; short presses that have not acted yet still act once."""
        for key in tuple(self._down):
            self.let_go(key)

    def forget_waiting(self) -> None:
        """Forget presses that have not acted; held directions stay held."""
        self._waiting.clear()

    def clear(self) -> None:
        """Forget everything, as at the start of a round and at a pause."""
        self._down.clear()
        self._held.clear()
        self._waiting.clear()

    def take(self) -> int:
        """The action of the tick that is now due."""
        while self._repeats and len(self._waiting) > 1 and self._outdone(self._waiting[0], self._waiting[1]):
            self._waiting.pop(0)
        if self._waiting:
            return ACTION_OF_KEY[self._waiting.pop(0).key]
        return ACTION_OF_KEY[self._held[-1]] if self._held and self._repeats else STAY

    @staticmethod
    def _outdone(first: _Press, second: _Press) -> bool:
        """True for a direction still held when the next was pressed: the latest one wins."""
        return first.held and first.key != "interact" and second.key != "interact"
