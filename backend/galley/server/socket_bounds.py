"""The websocket protocol of the server: uvicorn's, which takes what came part by part.

A read may hold tens of thousands of frames, and uvicorn parses all of them before anybody else gets a turn.
"""

from __future__ import annotations

import asyncio
from typing import Any, Final

from uvicorn._types import ASGIReceiveEvent
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode, Frame

from galley.server.limits import Pace

PART_BYTES: Final = 512
"""How much is parsed at once: some ten messages, or a hundred of the smallest frames."""

SPARE_FRAMES_PER_S: Final = 20.0
"""How many frames a second may be no whole message; browsers send none but answers to pings."""


class BoundedWebSocket(WebSocketsSansIOProtocol):
    """One connection: reads no further while messages wait, closes on a flood of pings or of parts."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._held = bytearray()
        self._next: asyncio.Handle | None = None
        self._spare = Pace(SPARE_FRAMES_PER_S, self.loop.time())

    def data_received(self, data: bytes) -> None:
        """Take what came: a handshake in full, frames part by part."""
        if not self.handshake_initiated:
            super().data_received(data)
            if not self.handshake_initiated:
                self._refuse_handshake()
            return
        self._held += data
        if self._next is None:
            self._feed()

    async def receive(self) -> ASGIReceiveEvent:
        """The next message for the application; once none waits, more is parsed."""
        message = await self.queue.get()
        if self.read_paused and self.queue.empty():
            self.read_paused = False
            if not self._held:
                self.transport.resume_reading()
            elif self._next is None:
                self._next = self.loop.call_soon(self._feed)
        return message

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget what is not parsed."""
        self._held.clear()
        super().connection_lost(exc)

    def handle_ping(self) -> None:
        """Answer a ping, unless there are too many."""
        self._count_spare()
        super().handle_ping()

    def handle_pong(self, event: Frame) -> None:
        """Take an answer to a ping, unless there are too many."""
        self._count_spare()
        super().handle_pong(event)

    def handle_cont(self, event: Frame) -> None:
        """Take a part of a message, unless there are too many."""
        self._count_spare()
        super().handle_cont(event)

    def _feed(self) -> None:
        self._next = None
        part = bytes(self._held[:PART_BYTES])
        del self._held[:PART_BYTES]
        super().data_received(part)
        if self.transport.is_closing():
            self._held.clear()
        elif self._held:
            self.transport.pause_reading()
            if not self.read_paused:
                self._next = self.loop.call_soon(self._feed)
        elif not self.read_paused:
            self.transport.resume_reading()

    def _count_spare(self) -> None:
        if self._spare.wait_s(self.loop.time()) > 0 and not self.transport.is_closing():
            self.conn.fail(CloseCode.POLICY_VIOLATION, "too many frames")
            self.handle_parser_exception()

    def _refuse_handshake(self) -> None:
        """Say what the parser has to say of a handshake that it cannot use, and close."""
        said = b"".join(self.conn.data_to_send())
        self.transport.write(said or b"HTTP/1.1 400 Bad Request\r\nconnection: close\r\n\r\n")
        self.transport.close()
