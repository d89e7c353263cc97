"""How long somebody who keeps guessing passwords has to wait."""

from __future__ import annotations

from dataclasses import dataclass

FREE_TRIES = 5
LONGEST_WAIT_S = 900.0
FORGET_AFTER_S = 3600.0
MOST_KEPT = 10_000


@dataclass(slots=True)
class _Failures:
    count: int
    last_s: float


class Throttle:
    """Counts wrong logins by key (an address, or a name at an address); times in monotonic seconds.

    The first FREE_TRIES failures cost nothing; each one more doubles the wait, up to LONGEST_WAIT_S.
    """

    def __init__(self) -> None:
        self._failures: dict[str, _Failures] = {}

    def wait_s(self, key: str, now_s: float) -> float:
        """Seconds until this key may try again; 0 if it may now."""
        found = self._failures.get(key)
        if found is None or found.count < FREE_TRIES:
            return 0.0
        wait = min(LONGEST_WAIT_S, 2.0 ** min(30, found.count - FREE_TRIES + 1))
        return max(0.0, found.last_s + wait - now_s)

    def failed(self, key: str, now_s: float) -> None:
        """Note a wrong login."""
        found = self._failures.get(key)
        if found is not None and now_s - found.last_s > FORGET_AFTER_S:
            found = None
        if found is None and len(self._failures) >= MOST_KEPT:
            oldest = min(self._failures, key=lambda other: self._failures[other].last_s)
            del self._failures[oldest]
        self._failures[key] = _Failures((found.count if found else 0) + 1, now_s)

    def succeeded(self, key: str) -> None:
        """Forget the failures of a key."""
        self._failures.pop(key, None)
