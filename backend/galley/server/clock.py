"""One clock for a serving process: monotonic seconds for deadlines, and as ms since 1970 for records."""

from __future__ import annotations

import time


class Clock:
    """Seconds that never jump, related once to the wall clock so that setting the latter moves no record."""

    def __init__(self) -> None:
        self._epoch_s = time.time() - time.monotonic()

    def now(self) -> float:
        """Monotonic seconds, the same clock as the event loop's `time()`."""
        return time.monotonic()

    def ms(self, at_s: float | None = None) -> float:
        """Milliseconds since 1970 of a monotonic instant, by default now."""
        return ((self.now() if at_s is None else at_s) + self._epoch_s) * 1000.0


class Stagger:
    """Hands out phases in [0, 1) that stay evenly spread however many have been handed out.

    Source: the golden-ratio additive recurrence, Kronecker sequences (Niederreiter 1992, Sec. 3.1).
    """

    def __init__(self) -> None:
        self._count = 0

    def phase(self) -> float:
        """The next phase."""
        self._count += 1
        return (self._count * 0.6180339887498949) % 1.0


def first_deadline(earliest_s: float, phase: float, tick_s: float) -> float:
    """The first instant from `earliest_s` on that lies `phase` of a tick after a multiple of `tick_s`."""
    whole = -(-(earliest_s / tick_s - phase) // 1)
    return (whole + phase) * tick_s
