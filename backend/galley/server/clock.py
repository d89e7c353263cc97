"""The clocks of a serving process: monotonic seconds for deadlines, and as ms since 1970 for records."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any, Final

from galley.errors import GalleyError
from galley.records import Store
from galley.records.reading.overdue import WallTime, latest_ms, wall_time

LOG = logging.getLogger(__name__)
LOOK_EVERY_S: Final = 1.0
STEP_MS: Final = 50.0
"""Differences from the wall clock below this are the measuring's."""
SLEPT_S: Final = 0.5
KEPT_AHEAD_MS: Final = 24 * 3_600_000.0
"""By so much at most times go on ahead of a wall clock that was set back."""


class Clock:
    """Monotonic seconds, and times for the records that never go back while somebody would notice.

    Both are related when the clock is made and again whenever `follow` is called, so that a machine that
    slept, was moved or had its clock set forward records the right times from then on. After a wall clock was
    set back, times go on from the latest one that a visit under way has, until the wall clock has come to it:
    what lies between two times is how long it took.
    """

    def __init__(self) -> None:
        self._epoch_s = time.time() - time.monotonic()
        self._asleep_s = _asleep_s()

    def now(self) -> float:
        """Monotonic seconds, the same clock as the event loop's `time()`."""
        return time.monotonic()

    def ms(self, at_s: float | None = None) -> float:
        """Milliseconds since 1970 of a monotonic instant, by default now."""
        return ((self.now() if at_s is None else at_s) + self._epoch_s) * 1000.0

    def follow(self, wall: WallTime, latest_ms: float | None) -> None:
        """Set it to the wall clock; or let times go on from the latest that there is, if that is later."""
        self.wake()
        now_ms = self.ms(wall.at_s)
        behind = latest_ms is not None and wall.wall_ms < latest_ms <= wall.wall_ms + KEPT_AHEAD_MS
        wanted_ms = max(now_ms, latest_ms) if behind and latest_ms is not None else wall.wall_ms
        if abs(wanted_ms - now_ms) > STEP_MS:
            self._epoch_s += (wanted_ms - now_ms) / 1000.0

    def wake(self) -> None:
        """Go on by the time that the machine slept since it was measured, where the system counts it."""
        asleep_s = _asleep_s()
        if asleep_s - self._asleep_s > SLEPT_S:
            self._epoch_s += asleep_s - self._asleep_s
            self._asleep_s = asleep_s


class WakingClock(Clock):
    """A clock that is right in the first instant after the machine slept, where the system counts that."""

    def ms(self, at_s: float | None = None) -> float:
        """Milliseconds since 1970 of a monotonic instant, by default now."""
        self.wake()
        return super().ms(at_s)


def _asleep_s() -> float:
    """How long the machine slept since it started, as far as the system tells."""
    with_sleep = getattr(time, "CLOCK_BOOTTIME", None)
    return 0.0 if with_sleep is None else time.clock_gettime(with_sleep) - time.monotonic()


class Following:
    """Lets clocks follow the wall clock that all servers on a database share, and tells when one was set.

    That of the pages follows at any time, that of the rounds only while none is played: the times within a
    round are of one measure.
    """

    def __init__(self, store: Store, pages: Clock, rounds: Clock, playing: Callable[[], bool]) -> None:
        self._store = store
        self._pages = pages
        self._rounds = rounds
        self._playing = playing
        self._ahead_ms: float | None = None

    async def watch(self) -> None:
        """Look again and again, until cancelled."""
        while True:
            await asyncio.sleep(LOOK_EVERY_S)
            await self.look()

    async def look(self) -> None:
        """Measure, and let the clocks follow; not while the database is away."""
        try:
            wall = await asyncio.wrap_future(self._store.read(wall_time))
            before_ms = max(self._pages.ms(wall.at_s), self._rounds.ms(wall.at_s))
            latest = None
            if self._ahead_ms is None or before_ms - wall.wall_ms > STEP_MS:
                latest = await asyncio.wrap_future(self._store.read(latest_ms))
        except GalleyError as error:
            LOG.warning("the clock could not be measured: %s", error)
            return
        except Exception:  # whatever the database refuses, times go on and are measured again
            LOG.exception("the clock could not be measured this time")
            return
        clocks = (self._pages,) if self._playing() else (self._pages, self._rounds)
        for clock in clocks:
            clock.follow(wall, latest)
        self._tell(self._pages.ms(wall.at_s) - wall.wall_ms, self._pages.ms(wall.at_s) - before_ms)

    def _tell(self, ahead_ms: float, moved_ms: float) -> None:
        if ahead_ms > STEP_MS and not (self._ahead_ms is not None and self._ahead_ms > STEP_MS):
            LOG.warning(
                "the clock is %.1f s behind what is recorded; times go on from there until no visit under "
                "way has a later one",
                ahead_ms / 1000,
            )
        elif abs(moved_ms) > STEP_MS:
            LOG.warning("times of records moved by %+.1f s: the clock was set, or slept", moved_ms / 1000)
        self._ahead_ms = ahead_ms


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
