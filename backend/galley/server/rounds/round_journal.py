"""What a live round writes down as it happens: ticks, keys, pauses, pings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from galley.protocol.messages import Key, Ping, Release
from galley.records import ClockRow, KeyRow, Lease, PauseRow, TickRow
from galley.server.clock import Clock

PING_STORED_EVERY_S = 1.0


class JournalStore(Protocol):
    """The part of the store that a round writes to; returns at once."""

    def journal(
        self,
        round_id: int,
        ticks: Sequence[TickRow] = ...,
        keys: Sequence[KeyRow] = ...,
        pauses: Sequence[PauseRow] = ...,
        clocks: Sequence[ClockRow] = ...,
        lease: Lease | None = ...,
    ) -> None:
        """Take rows."""


class SentAt:
    """When a message was handed to the socket, monotonic seconds; None until then."""

    __slots__ = ("at_s",)

    def __init__(self) -> None:
        self.at_s: float | None = None


@dataclass(slots=True)
class Played:
    """One tick that was played; instants in monotonic seconds.

    `decision_ms` is None if no agent plays or it was `late`.
    """

    tick: int
    joint: tuple[int, int]
    deadline_s: float
    computed_s: float
    sent_at: SentAt
    decision_ms: float | None
    late: bool
    fault: str | None


class RoundJournal:
    """Writes one round's rows to the store, for as long as the round is this process's by its lease."""

    def __init__(self, store: JournalStore, clock: Clock, round_id: int, lease: Lease | None = None) -> None:
        self._store = store
        self._clock = clock
        self._round_id = round_id
        self.lease = lease
        self._last: Played | None = None
        self._last_ping_s = [-math.inf, -math.inf]

    @property
    def lost(self) -> bool:
        """Whether another process has the round now, so that nothing more of this one is kept."""
        return self.lease is not None and self.lease.lost

    def played(self, played: Played) -> None:
        """Note a tick; it is written with the next, when it is known when it was handed to the socket."""
        self.write()
        self._last = played

    def write(self) -> None:
        """Write the tick noted last."""
        last = self._last
        if last is None:
            return
        self._last = None
        sent_s = last.computed_s if last.sent_at.at_s is None else last.sent_at.at_s
        row = TickRow(
            last.tick,
            *last.joint,
            deadline_ms=self._clock.ms(last.deadline_s),
            lateness_ms=(sent_s - last.deadline_s) * 1000.0,
            decision_ms=last.decision_ms,
            late=last.late,
            fault=last.fault,
        )
        self._store.journal(self._round_id, ticks=[row], lease=self.lease)

    def key(self, message: Key | Release, arrival_s: float, tick: int, seat: int) -> None:
        """Note a key event at a seat and the first tick it can act on."""
        key, down = (message.key, message.down) if isinstance(message, Key) else ("release", False)
        row = KeyRow(message.seq, key, down, message.client_ms, self._clock.ms(arrival_s), tick, seat)
        self._store.journal(self._round_id, keys=[row], lease=self.lease)

    def pause(self, tick: int, reason: str) -> PauseRow:
        """Note that the kitchen stands still from now on."""
        row = PauseRow(tick, self._clock.ms(), None, reason)
        self._store.journal(self._round_id, pauses=[row], lease=self.lease)
        return row

    def goes_on(self, pause: PauseRow) -> None:
        """Note that a pause is over now."""
        row = PauseRow(pause.tick, pause.started_ms, self._clock.ms(), pause.reason)
        self._store.journal(self._round_id, pauses=[row], lease=self.lease)

    def ping(self, ping: Ping, arrival_s: float, seat: int) -> None:
        """Note a ping, at most one a second of each seat."""
        if arrival_s - self._last_ping_s[seat] >= PING_STORED_EVERY_S:
            self._last_ping_s[seat] = arrival_s
            row = ClockRow(ping.client_ms, self._clock.ms(arrival_s), ping.rtt_ms, seat)
            self._store.journal(self._round_id, clocks=[row], lease=self.lease)
