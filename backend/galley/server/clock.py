"""One clock for a serving process: monotonic seconds for deadlines, and as ms since 1970 for records."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any


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


class Deadlines:
    """When each tick of a round is due, in seconds of the event loop's clock.

    `begin` fixes those of all ticks left, `tick_s` apart and at the phase of the tick that the round was
    given (`stagger` in [0, 1)), so that rounds do not tick in step.
    """

    def __init__(self, tick_s: float, stagger: float) -> None:
        self._tick_s = tick_s
        self._stagger = stagger
        self._start_s = 0.0
        self._start_tick = 0

    def begin(self, now_s: float, tick: int) -> None:
        """Fix the deadlines from `tick` on: it is due a whole tick from now at the earliest."""
        self._start_tick = tick
        self._start_s = first_deadline(now_s + self._tick_s, self._stagger, self._tick_s)

    def of(self, tick: int) -> float:
        """When a tick is due."""
        return self._start_s + (tick - self._start_tick) * self._tick_s


class Timer:
    """One call that is due later; a new one takes the place of the one before."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._handle: asyncio.TimerHandle | None = None

    @property
    def runs(self) -> bool:
        """Whether a call is still to come."""
        return self._handle is not None

    def set(self, at_s: float, call: Callable[..., None], *arguments: Any) -> None:
        """Let `call` be made at an instant of the event loop's clock."""
        self.cancel()

        def ring() -> None:
            self._handle = None
            call(*arguments)

        self._handle = self._loop.call_at(at_s, ring)

    def cancel(self) -> None:
        """Let no call be made."""
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None
