"""A participant at a seat of a live round: their connection, their keys, whether they are ready."""

from __future__ import annotations

from typing import Protocol

from galley.protocol.codec import encode
from galley.protocol.messages import Outgoing
from galley.server.rounds.key_state import KeyState
from galley.server.rounds.round_journal import SentAt


class Connection(Protocol):
    """A browser's socket as a match sees it: nothing here waits."""

    tab: str

    def send(self, text: str, sent_at: SentAt | None = None) -> None:
        """Queue a frame."""

    def close(self, code: int) -> None:
        """Close once everything queued is sent."""


class Person:
    """One participant of a round. `hats` are the colours of seat 0 and seat 1 as this participant sees them.

    `here` says whether somebody is connected; `ready` whether they pressed Start, or are back after a pause.
    """

    def __init__(
        self, seat: int, visit_id: int, hats: tuple[str, str], next_url: str, *, repeats: bool = True
    ) -> None:
        self.seat = seat
        self.visit_id = visit_id
        self.hats = hats
        self.next_url = next_url
        self.keys = KeyState(repeats=repeats)
        self.connection: Connection | None = None
        self.ready = False
        self.hidden_ms: float | None = None
        self.absences = 0

    @property
    def here(self) -> bool:
        """Whether a browser is connected."""
        return self.connection is not None

    def send(self, message: Outgoing) -> None:
        """Send a message, if anybody is there to read it."""
        if self.connection is not None:
            self.connection.send(encode(message))

    def close(self, code: int) -> None:
        """Close the connection, if there is one."""
        if self.connection is not None:
            self.connection.close(code)
