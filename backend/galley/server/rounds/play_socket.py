"""The play socket: one browser's connection to its round."""

from __future__ import annotations

import asyncio
import logging
from collections import deque

from starlette.responses import Response
from starlette.websockets import WebSocket, WebSocketDisconnect

from galley.protocol import messages as wire
from galley.server.headers import same_origin
from galley.server.limits import Paces, network_of
from galley.server.participant.visits import Visits
from galley.server.rounds.match import LEFT, RESTART
from galley.server.rounds.matches import Matches, Place, RoundBusy
from galley.server.rounds.relay import RELAYED, pass_on
from galley.server.rounds.round_journal import Handed

LOG = logging.getLogger(__name__)
MAX_BEHIND = 200
MOST_SOCKETS = 4
SOCKETS_PER_S = 1.0
SOCKETS_AT_ONCE = 20
HELLO_WITHIN_S = 20.0
CLOSE_WITHIN_S = 5.0
SERVICE_RESTART = 1012  # RFC 6455 registry: the server is going down; browsers cannot send it


class Socket:
    """Sends frames in order without making anybody wait.

    A browser that is MAX_BEHIND frames behind gets, instead of those, one picture of the whole when it is
    there again.
    """

    def __init__(self, websocket: WebSocket) -> None:
        self.tab = ""
        self.place: Place | None = None
        self._websocket = websocket
        self._loop = asyncio.get_running_loop()
        self._queue: deque[tuple[str, Handed | None]] = deque()
        self._wake = asyncio.Event()
        self._close_code: int | None = None
        self._behind = False

    def send(self, text: str, handed: Handed | None = None) -> None:
        """Queue a frame; `handed` learns when it was given to the socket."""
        if len(self._queue) >= MAX_BEHIND:
            self._queue.clear()
            self._behind = True
        if not self._behind:
            self._queue.append((text, handed))
            self._wake.set()

    def close(self, code: int) -> None:
        """Close once everything queued is sent."""
        if self._close_code is None:
            self._close_code = code
        self._wake.set()

    @property
    def closing(self) -> bool:
        """Whether `close` was called."""
        return self._close_code is not None

    async def run(self) -> None:
        """Send until closed or lost."""
        try:
            while True:
                while self._queue:
                    text, handed = self._queue.popleft()
                    await self._websocket.send_text(text)
                    if handed is not None:
                        handed.at_s = self._loop.time()
                if self._behind:
                    self._behind = False
                    if self.place is not None and self.place.person.connection is self:
                        self.place.match.show(self.place.person)
                        continue
                if self._close_code is not None:
                    await self._websocket.close(self._close_code)
                    return
                self._wake.clear()
                await self._wake.wait()
        except (WebSocketDisconnect, RuntimeError, OSError):
            # The browser is gone; the listening side sees it too and tells the match.
            return


class Play:
    """The endpoint of all play sockets."""

    def __init__(
        self, visits: Visits, matches: Matches, messages_per_s: int, address_messages_per_s: int
    ) -> None:
        self._visits = visits
        self._matches = matches
        self._of_visit = Paces(messages_per_s)
        self._of_address = Paces(address_messages_per_s)
        self._arrivals = Paces(SOCKETS_PER_S, SOCKETS_AT_ONCE)
        self._open: dict[str, list[Socket]] = {}

    async def endpoint(self, websocket: WebSocket, token: str) -> None:
        """One connection from handshake to close; a foreign page or an unknown link gets 403."""
        now_s = asyncio.get_running_loop().time()
        if self._arrivals.of(token, now_s).wait_s(now_s, patience_s=0.0) > 0:
            await websocket.send_denial_response(Response(status_code=429))
            return
        if not same_origin(websocket.headers) or await self._visits.find(token) is None:
            await websocket.close()
            return
        await websocket.accept()
        socket = Socket(websocket)
        self._enter(token, socket)
        sender = asyncio.create_task(socket.run())
        reason = LEFT
        try:
            reason = await self._listen(websocket, socket, token)
            if socket.closing:
                await asyncio.wait([sender], timeout=CLOSE_WITHIN_S)
        finally:
            if socket.place is not None:
                socket.place.match.leave(socket, reason)
            sender.cancel()
            self._leave(token, socket)

    def _enter(self, token: str, socket: Socket) -> None:
        """Count a socket of a visit; the oldest that plays no round makes room for one too many."""
        there = self._open.setdefault(token, [])
        there.append(socket)
        if len(there) > MOST_SOCKETS:
            idle = (one for one in there if one.place is None or one.place.person.connection is not one)
            oldest = next(idle)
            there.remove(oldest)
            oldest.close(wire.CLOSE_REPLACED)

    def _leave(self, token: str, socket: Socket) -> None:
        there = self._open.get(token, [])
        if socket in there:
            there.remove(socket)
        if not there:
            self._open.pop(token, None)

    async def _listen(self, websocket: WebSocket, socket: Socket, token: str) -> str:
        loop = asyncio.get_running_loop()
        address = network_of(websocket.client.host) if websocket.client else ""
        paces = [self._of_visit.of(token, loop.time())]
        if address:
            paces.append(self._of_address.of(address, loop.time()))

        async def paced() -> None:
            for pace in paces:
                await pace.wait()

        hello_by_s = loop.time() + HELLO_WITHIN_S
        last_seq = -1
        while True:
            if socket.place is not None:
                event = await websocket.receive()
            else:
                try:
                    async with asyncio.timeout_at(hello_by_s):
                        event = await websocket.receive()
                except TimeoutError:
                    socket.close(wire.CLOSE_REFUSED)
                    return LEFT
            if event["type"] == "websocket.disconnect":
                return RESTART if event.get("code") == SERVICE_RESTART else LEFT
            arrival_s = loop.time()
            try:
                text = event.get("text")
                frame = event.get("bytes") or b"" if text is None else text
                message = wire.parse(frame)
                if isinstance(message, wire.Key | wire.Release):
                    if message.seq <= last_seq:
                        raise wire.MessageError(f"seq {message.seq} does not come after {last_seq}")
                    last_seq = message.seq
                if isinstance(message, wire.Hello):
                    busy = await self._hello(socket, token, message)
                    if busy is not None and busy.address and RELAYED not in websocket.headers:
                        path = websocket.url.path
                        code = await pass_on(websocket, busy.address, path, frame, paced)
                        socket.close(code)
                    elif busy is not None:
                        socket.close(wire.CLOSE_BUSY)
                    if socket.place is None:
                        return LEFT
                elif socket.place is None:
                    raise wire.MessageError("the first message is hello")
                else:
                    _pass_on(socket.place, socket, message, arrival_s)
            except wire.MessageError as error:
                socket.send(wire.encode("refused", reason=str(error)))
            await paced()

    async def _hello(self, socket: Socket, token: str, hello: wire.Hello) -> RoundBusy | None:
        """Give the socket its place, or close it, or say that another process has the round.

        Raises: MessageError for a second hello.
        """
        if socket.place is not None:
            raise wire.MessageError("hello was said already")
        if hello.protocol != wire.PROTOCOL:
            socket.send(
                wire.encode("refused", reason=f"the protocol is {wire.PROTOCOL}; load the page again")
            )
            socket.close(wire.CLOSE_REFUSED)
            return None
        visit = await self._visits.find(token)
        try:
            place = None if visit is None else await self._matches.of(visit)
        except RoundBusy as busy:
            return busy
        if place is None:
            socket.close(wire.CLOSE_ENDED)
            return None
        socket.tab = hello.tab
        socket.place = place
        place.match.join(place.person, socket)
        return None


def _pass_on(place: Place, socket: Socket, message: wire.Incoming, arrival_s: float) -> None:
    """Give a message to the match. Raises: MessageError when it is out of turn."""
    match, person = place.match, place.person
    if person.connection is not socket:
        raise wire.MessageError("this round is open in another tab")
    match message:
        case wire.Ready():
            match.ready(person)
        case wire.Key():
            match.key(person, message, arrival_s)
        case wire.Release():
            match.release(person, message, arrival_s)
        case wire.Ping():
            match.ping(person, message, arrival_s)
