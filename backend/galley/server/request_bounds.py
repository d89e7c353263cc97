"""The HTTP protocol of the server: uvicorn's, with bounds on the size and the time of a request.

Neither httptools nor uvicorn bounds a header, so that without a proxy in front one long header would keep the
event loop, and every round with it, waiting. Websocket handshakes come through here as well.
"""

from __future__ import annotations

import asyncio
from typing import Final

from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol

MAX_HEAD_BYTES: Final = 64 * 1024
"""The most that a request may send besides its body: its line, headers, chunk sizes and trailers."""

HEAD_WITHIN_S: Final = 10.0
BODY_WITHIN_S: Final = 15.0
SLOWEST_BYTES_PER_S: Final = 4096
"""A body gets BODY_WITHIN_S, and a second more for every so many bytes that have come."""

MAX_UNREAD_BYTES: Final = 256 * 1024
"""The most of a body that is dropped, once its request is answered, before the connection is closed."""

LINGER_S: Final = 2.0
"""How long the rest of a refused request is read and dropped, so that its sender sees the answer."""
DROPPED_EVERY_S: Final = 0.02
"""How often of it is read: what comes faster waits in the network, and takes no time from others."""


class BoundedHttp(HttpToolsProtocol):
    """One connection: 431 for a head beyond MAX_HEAD_BYTES, 408 for one that does not come to its end."""

    _framing_bytes = 0
    _body_bytes = 0
    _refused = False
    _in_body = False
    _since_s = 0.0
    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._watch(HEAD_WITHIN_S)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._unwatch()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take what came, unless the request was refused already."""
        if self._refused:
            self._rest()
            return
        if self._timer is None:
            self._watch(HEAD_WITHIN_S)
        self._framing_bytes += len(data)
        super().data_received(data)
        if self._framing_bytes > MAX_HEAD_BYTES:
            self._refuse(431, "The headers of this request are too large.")

    def handle_websocket_upgrade(self) -> None:
        """Leave the connection to the websocket."""
        self._unwatch()
        self._framing_bytes = 0
        super().handle_websocket_upgrade()

    def send_400_response(self, msg: str) -> None:
        """Refuse what is no request."""
        self._refuse(400, msg)

    # ---- the parser's callbacks ----------------------------------------------------------------------------

    def on_message_begin(self) -> None:
        """A request begins; what came before belongs to another."""
        self._framing_bytes = self._body_bytes = 0
        self._in_body = False
        if self._timer is None:
            self._watch(HEAD_WITHIN_S)
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        """The head is there; one that came in a single read is measured here.

        Raises:
            ValueError: when it is too large; the parser stops.
        """
        if len(self.url) + sum(len(name) + len(value) + 4 for name, value in self.headers) > MAX_HEAD_BYTES:
            self._refuse(431, "The headers of this request are too large.")
            raise ValueError("too large")
        super().on_headers_complete()
        self._in_body = True
        self._watch(BODY_WITHIN_S)

    def on_body(self, body: bytes) -> None:
        """A part of the body is there."""
        self._body_bytes += len(body)
        self._framing_bytes = max(0, self._framing_bytes - len(body))
        super().on_body(body)
        if self.cycle.response_complete and self._body_bytes > MAX_UNREAD_BYTES:
            self._linger()

    def on_message_complete(self) -> None:
        """The request is there in full."""
        self._unwatch()
        super().on_message_complete()

    # ---- time ----------------------------------------------------------------------------------------------

    def _watch(self, within_s: float) -> None:
        self._unwatch()
        self._since_s = self.loop.time()
        self._timer = self.loop.call_later(within_s, self._look)

    def _unwatch(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _look(self) -> None:
        allowed_s = HEAD_WITHIN_S
        if self._in_body:
            allowed_s = BODY_WITHIN_S + self._body_bytes / SLOWEST_BYTES_PER_S
        left_s = self._since_s + allowed_s - self.loop.time()
        if self.flow.read_paused:  # the application is the slow one
            left_s = max(left_s, 1.0)
        if left_s > 0:
            self._timer = self.loop.call_later(left_s, self._look)
        elif self.scope is None:  # nothing came at all: a browser that connected ahead
            self.transport.close()
        else:
            self._refuse(408, "This request took too long.")

    def _refuse(self, status: int, why: str) -> None:
        """Answer, unless an answer is on its way, and close."""
        if self._refused or self.transport.is_closing():
            return
        answering = bool(self.cycle) and not self.cycle.response_complete
        if not (answering and self.cycle.response_started):
            head = f"content-type: text/plain\r\ncontent-length: {len(why)}\r\nconnection: close\r\n\r\n"
            self.transport.write(STATUS_LINE[status] + f"{head}{why}".encode("ascii"))
        if answering:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        self._linger()

    def _linger(self) -> None:
        """Close, but read on for LINGER_S."""
        if self._refused:
            return
        self._refused = True
        self._unset_keepalive_if_required()
        self._unwatch()
        self.flow.resume_reading()
        if self.transport.can_write_eof():
            self.transport.write_eof()
        self._timer = self.loop.call_later(LINGER_S, self.transport.abort)

    def _rest(self) -> None:
        """Read on a little later."""
        if not self.transport.is_closing():
            self.transport.pause_reading()
            self.loop.call_later(DROPPED_EVERY_S, self._read_on)

    def _read_on(self) -> None:
        if not self.transport.is_closing():
            self.transport.resume_reading()
