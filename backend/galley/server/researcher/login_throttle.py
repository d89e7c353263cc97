"""How long somebody who keeps guessing passwords has to wait."""

from __future__ import annotations

from dataclasses import dataclass

FREE_TRIES = 5
FREE_TRIES_OF_A_NAME = 20
LONGEST_WAIT_S = 900.0
LONGEST_WAIT_OF_A_NAME_S = 30.0
FORGET_AFTER_S = 3600.0
MOST_KEPT = 10_000
CROWD = ""


@dataclass(slots=True)
class _Failures:
    count: int
    last_s: float


class Throttle:
    """Counts wrong logins by key (an address, a name, or a name at an address); times in monotonic seconds.

    The first `free` failures cost nothing; each one more doubles the wait, up to `longest_s`. A flood of keys
    pushes nobody out: those who find no room are counted together.
    """

    def __init__(self, free: int = FREE_TRIES, longest_s: float = LONGEST_WAIT_S) -> None:
        self._free = free
        self._longest_s = longest_s
        self._failures: dict[str, _Failures] = {}

    def wait_s(self, key: str, now_s: float) -> float:
        """Seconds until this key may try again; 0 if it may now."""
        key = self._counted(key)
        found = self._failures.get(key)
        if found is None or found.count < self._free:
            return 0.0
        longest_s = min(self._longest_s, LONGEST_WAIT_OF_A_NAME_S) if key == CROWD else self._longest_s
        wait = min(longest_s, 2.0 ** min(30, found.count - self._free + 1))
        return max(0.0, found.last_s + wait - now_s)

    def failed(self, key: str, now_s: float) -> None:
        """Note a wrong login."""
        if key not in self._failures and len(self._failures) >= MOST_KEPT:
            self._failures = {
                name: one for name, one in self._failures.items() if now_s - one.last_s <= FORGET_AFTER_S
            }
        key = self._counted(key)
        found = self._failures.get(key)
        if found is not None and now_s - found.last_s > FORGET_AFTER_S:
            found = None
        self._failures[key] = _Failures((found.count if found else 0) + 1, now_s)

    def succeeded(self, key: str) -> None:
        """Forget the failures of a key."""
        self._failures.pop(key, None)

    def _counted(self, key: str) -> str:
        """The key that a key is counted by: its own if there is room, else that of the crowd."""
        return key if key in self._failures or len(self._failures) < MOST_KEPT else CROWD
