"""The play socket: one browser's connection to its round."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from enum import Enum

from starlette.responses import Response
from starlette.websockets import WebSocket, WebSocketDisconnect

from galley.protocol.codec import MessageError, encode, parse, parse_outgoing
from galley.protocol.messages import (
    CLOSE_BUSY,
    CLOSE_ENDED,
    CLOSE_REFUSED,
    CLOSE_REPLACED,
    CLOSE_RESTART,
    PROTOCOL,
    Hello,
    Incoming,
    Key,
    Ping,
    Ready,
    Release,
)
from galley.server.headers import same_origin, tell_foreign
from galley.server.limits import Pace, Paces, network_of
from galley.server.participant.visits import Visits
from galley.server.rounds.match import LEFT, RESTART
from galley.server.rounds.matches import Matches, Place, RoundBusy
from galley.server.rounds.relay import RELAYED, pass_on
from galley.server.rounds.round_journal import SentAt

LOG = logging.getLogger(__name__)
MAX_BEHIND = 200
MOST_SOCKETS = 4
SOCKETS_PER_S = 1.0
SOCKETS_AT_ONCE = 20
SOCKET_REFUSED_AFTER_S = 5.0
"""How late a socket too many is refused: each costs a handshake, and who floods asks again at once."""
HELLO_WITHIN_S = 20.0
CLOSE_WITHIN_S = 5.0


class Socket:
    """Sends frames in order without making anybody wait.

    A browser that is MAX_BEHIND frames behind gets, instead of those, one picture of the whole when it is
    there again. What is `checked` is compared with the protocol's table before it goes out.
    """

    def __init__(self, websocket: WebSocket, *, checked: bool = False) -> None:
        self._checked = checked
        self.tab = ""
        self.place: Place | None = None
        self._websocket = websocket
        self._loop = asyncio.get_running_loop()
        self._queue: deque[tuple[str, SentAt | None]] = deque()
        self._wake = asyncio.Event()
        self._close_code: int | None = None
        self._behind = False

    def send(self, text: str, sent_at: SentAt | None = None) -> None:
        """Queue a frame; `sent_at` learns when it was given to the socket.

        Raises:
            MessageError: it is checked, and not as the protocol's table says.
        """
        if self._checked:
            parse_outgoing(text)
        if len(self._queue) >= MAX_BEHIND:
            self._queue.clear()
            self._behind = True
        if not self._behind:
            self._queue.append((text, sent_at))
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
                    text, sent_at = self._queue.popleft()
                    await self._websocket.send_text(text)
                    if sent_at is not None:
                        sent_at.at_s = self._loop.time()
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


class Stage(Enum):
    """How far a conversation has come."""

    GREETING = "the browser has not said hello, or not yet got its place"
    PLAYING = "the browser has its place in a round"
    OVER = "nothing more is listened to"


class Play:
    """The endpoint of all play sockets; with `debug` every message to a browser is checked."""

    def __init__(
        self,
        visits: Visits,
        matches: Matches,
        messages_per_s: int,
        address_messages_per_s: int,
        *,
        debug: bool = False,
    ) -> None:
        self.visits = visits
        self.matches = matches
        self._debug = debug
        self._of_visit = Paces(messages_per_s)
        self._of_address = Paces(address_messages_per_s)
        self._arrivals = Paces(SOCKETS_PER_S, SOCKETS_AT_ONCE)
        self._open: dict[str, list[Socket]] = {}

    async def endpoint(self, websocket: WebSocket) -> None:
        """One connection from handshake to close; a foreign page or an unknown link gets 403."""
        token = websocket.path_params["token"]
        now_s = asyncio.get_running_loop().time()
        if self._arrivals.of(token, now_s).wait_s(now_s, patience_s=0.0) > 0:
            await asyncio.sleep(SOCKET_REFUSED_AFTER_S)
            await websocket.send_denial_response(Response(status_code=429))
            return
        if not same_origin(websocket.headers):
            tell_foreign(websocket.headers)
            await websocket.close()
            return
        if await self.visits.find(token) is None:
            await websocket.close()
            return
        await websocket.accept()
        socket = Socket(websocket, checked=self._debug)
        self._enter(token, socket)
        sender = asyncio.create_task(socket.run())
        conversation = Conversation(self, websocket, socket, token)
        try:
            await conversation.run()
            if socket.closing:
                await asyncio.wait([sender], timeout=CLOSE_WITHIN_S)
        finally:
            if socket.place is not None:
                socket.place.match.leave(socket, conversation.reason)
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
            oldest.close(CLOSE_REPLACED)

    def _leave(self, token: str, socket: Socket) -> None:
        there = self._open.get(token, [])
        if socket in there:
            there.remove(socket)
        if not there:
            self._open.pop(token, None)

    def paces(self, websocket: WebSocket, token: str, now_s: float) -> list[Pace]:
        """The paces that a connection's messages keep to: its visit's and its address's."""
        paces = [self._of_visit.of(token, now_s)]
        if websocket.client:
            paces.append(self._of_address.of(network_of(websocket.client.host), now_s))
        return paces


class Conversation:
    """What one browser says from its hello on, each message given to its round; `reason` is why it ended."""

    def __init__(self, play: Play, websocket: WebSocket, socket: Socket, token: str) -> None:
        self.stage = Stage.GREETING
        self.reason = LEFT
        self._play = play
        self._websocket = websocket
        self._socket = socket
        self._token = token
        self._loop = asyncio.get_running_loop()
        self._paces = play.paces(websocket, token, self._loop.time())
        self._hello_by_s = self._loop.time() + HELLO_WITHIN_S
        self._last_seq = -1

    async def run(self) -> None:
        """Listen until it is over."""
        while (frame := await self._frame()) is not None:
            arrival_s = self._loop.time()
            try:
                await self._take(frame, arrival_s)
            except MessageError as error:
                self._refuse(str(error))
            if self.stage is Stage.OVER:
                return
            await self._paced()

    async def _paced(self) -> None:
        for pace in self._paces:
            await pace.wait()

    async def _frame(self) -> str | bytes | None:
        """The next frame; None when none comes, because the browser is gone or never said hello."""
        try:
            async with asyncio.timeout_at(self._hello_by_s if self.stage is Stage.GREETING else None):
                event = await self._websocket.receive()
        except TimeoutError:
            self._close(CLOSE_REFUSED)
            return None
        if event["type"] == "websocket.disconnect":
            self.stage = Stage.OVER
            self.reason = RESTART if event.get("code") == CLOSE_RESTART else LEFT
            return None
        text: str | None = event.get("text")
        return event.get("bytes") or b"" if text is None else text

    async def _take(self, frame: str | bytes, arrival_s: float) -> None:
        """Use one message.

        Raises:
            MessageError: it is none of the protocol's, or out of turn.
        """
        message = parse(frame)
        if isinstance(message, Key | Release):
            if message.seq <= self._last_seq:
                raise MessageError(f"seq {message.seq} does not come after {self._last_seq}")
            self._last_seq = message.seq
        place = self._socket.place
        if isinstance(message, Hello):
            if place is not None:
                raise MessageError("hello was said already")
            await self._greet(message, frame)
        elif place is None:
            raise MessageError("the first message is hello")
        else:
            _give(place, self._socket, message, arrival_s)

    async def _greet(self, hello: Hello, frame: str | bytes) -> None:
        """Give the browser its place, or carry what it says to the process that has the round, or close."""
        if hello.protocol != PROTOCOL:
            self._refuse(f"the protocol is {PROTOCOL}; load the page again")
            self._close(CLOSE_REFUSED)
            return
        visit = await self._play.visits.find(self._token)
        try:
            place = None if visit is None else await self._play.matches.of(visit)
        except RoundBusy as busy:
            self._close(await self._relayed(busy, frame))
            return
        if place is None:
            self._close(CLOSE_ENDED)
            return
        self.stage = Stage.PLAYING
        self._socket.tab = hello.tab
        self._socket.place = place
        place.match.join(place.person, self._socket)

    async def _relayed(self, busy: RoundBusy, frame: str | bytes) -> int:
        """The code to close with, once the process that has the round has said all it had to say."""
        if not busy.address or RELAYED in self._websocket.headers:
            return CLOSE_BUSY
        path = self._websocket.url.path
        return await pass_on(self._websocket, busy.address, path, frame, self._paced)

    def _refuse(self, reason: str) -> None:
        self._socket.send(encode({"type": "refused", "reason": reason}))

    def _close(self, code: int) -> None:
        self.stage = Stage.OVER
        self._socket.close(code)


def _give(place: Place, socket: Socket, message: Incoming, arrival_s: float) -> None:
    """Give a message to the match.

    Raises:
        MessageError: it is out of turn.
    """
    match, person = place.match, place.person
    if person.connection is not socket:
        raise MessageError("this round is open in another tab")
    match message:
        case Ready():
            match.ready(person)
        case Key():
            match.key(person, message, arrival_s)
        case Release():
            match.release(person, message, arrival_s)
        case Ping():
            match.ping(person, message, arrival_s)
