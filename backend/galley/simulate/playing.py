"""Plays one round over its websocket: sees frames, thinks, and presses keys a moment later."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from random import Random
from typing import Any, Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from galley.kitchen import Layout
from galley.protocol.codec import MessageError, encode_incoming, parse_outgoing
from galley.protocol.messages import (
    CLOSE_ENDED,
    CLOSE_REFUSED,
    CLOSE_REPLACED,
    PROTOCOL,
    Hello,
    Incoming,
    Key,
    Ping,
    Ready,
)
from galley.simulate.results import Figures
from galley.simulate.seen import MakeAgent, Seen

PING_EVERY_S: Final = 1.0
REACTION_OF_TICK: Final = (0.1, 0.4)
"""When in a tick a key is pressed, as shares of it."""
TAP_OF_TICK: Final = 0.3
ANSWERED_WITHIN_S: Final = 3.0
"""A key whose effect is not seen by then had none that can be seen."""
RECONNECT_S: Final = (0.2, 0.5, 1.0, 2.0, 2.0, 3.0, 3.0, 5.0, 5.0, 5.0)


class RoundLost(Exception):
    """The round could not be played to its end; the text says why."""


@dataclass
class Player:
    """Plays a round at `url` until it has ended, or until `leave_at` ticks of it are over.

    `thinks` runs the agent, so that a slow one does not hold up the frames of others.
    """

    url: str
    make: MakeAgent
    layouts: Mapping[str, Layout]
    rng: Random
    figures: Figures
    thinks: Executor
    leave_at: int | None = None
    outcome: str = ""
    ticks: int = 0
    _seen: Seen | None = None
    _seq: int = 0
    _phase: str = ""
    _presses: deque[tuple[float, str]] = field(default_factory=deque)
    _tick_at_s: float | None = None
    _tick_s: float = 0.15

    async def play(self) -> str:
        """How the round ended: its outcome, `left` when the participant left, `over` when it was over before.

        Raises:
            RoundLost: the server cannot be reached again, turns the participant away, or says what the
                protocol does not know.
        """
        waits = iter(RECONNECT_S)
        while True:
            before = self.ticks
            try:
                async with connect(self.url, compression=None, open_timeout=20, max_queue=64) as socket:
                    code = await self._connected(socket)
            except (OSError, TimeoutError, InvalidStatus, ConnectionClosed) as error:
                code, why = 0, f"{type(error).__name__}: {error}"
            else:
                why = f"closed with {code}"
            if self.outcome:
                return self.outcome
            if code == CLOSE_ENDED:
                return "over"
            if code in (CLOSE_REPLACED, CLOSE_REFUSED):
                raise RoundLost(f"the server closed the round with {code}")
            if self.ticks > before:
                waits = iter(RECONNECT_S)
            wait_s = next(waits, None)
            if wait_s is None:
                raise RoundLost(f"the connection was lost after {self.ticks} ticks ({why})")
            self.figures.reconnects += 1
            await asyncio.sleep(wait_s)

    async def _connected(self, socket: ClientConnection) -> int:
        await _send(socket, Hello(PROTOCOL, f"simulated {self.rng.getrandbits(48):x}"))
        self._seq, self._tick_at_s = 0, None
        pinging = asyncio.create_task(self._ping(socket))
        thinking: asyncio.Task[None] | None = None
        try:
            async for text in socket:
                frame = _read(text)
                ticked = self._frame(frame)
                if frame["type"] == "ended":
                    self.outcome = str(frame["outcome"])
                if frame["type"] == "keyframe" and self._phase in ("waiting", "paused"):
                    await _send(socket, Ready())
                if self.outcome:
                    break
                if ticked and (thinking is None or thinking.done()):
                    thinking = asyncio.create_task(self._think(socket))
        except ConnectionClosed:
            return int(socket.close_code or 0)
        finally:
            for task in (pinging, thinking):
                if task is not None:
                    task.cancel()
                    await asyncio.gather(task, return_exceptions=True)
        return int(socket.close_code or 0)

    def _frame(self, frame: Mapping[str, Any]) -> bool:
        """Take a frame in; True when a tick was played and another follows."""
        match frame["type"]:
            case "keyframe":
                self._phase = frame["phase"]
                self._tick_s = frame["tick_ms"] / 1000.0
                self._tick_at_s = None
                if self._seen is None or self._seen.episode != frame["episode"]:
                    self._seen = Seen(frame, self.make, self.layouts, self.rng.getrandbits(31))
                else:
                    self._seen.look_again(frame)
            case "tick" if self._seen is not None:
                self._ticked(self._seen, frame)
                return self.outcome == "" and self._seen.tick < self._seen.layout.rules.horizon_ticks
            case "refused":
                self.figures.refused[str(frame["reason"])] += 1
        return False

    def _ticked(self, seen: Seen, frame: Mapping[str, Any]) -> None:
        now_s = time.monotonic()
        if frame["tick"] != seen.tick + 1:
            self.figures.lost_ticks += 1
        if self._tick_at_s is not None:
            self.figures.tick_ms.append((now_s - self._tick_at_s) * 1000.0)
            self.figures.off_ms.append(abs(now_s - self._tick_at_s - self._tick_s) * 1000.0)
        self._tick_at_s = now_s
        self.ticks += 1
        self.figures.ticks += 1
        before = seen.facing
        seen.see(frame)
        if seen.facing != before:
            self._turned(seen.facing, now_s)
        if self.leave_at is not None and self.ticks >= self.leave_at:
            self.outcome = "left"

    def _turned(self, key: str, now_s: float) -> None:
        """The own chef turns the way of this key: the first such press still unanswered did it.

        Presses take effect in their order, so those before it had none that can be seen.
        """
        while self._presses and now_s - self._presses[0][0] > ANSWERED_WITHIN_S:
            self._presses.popleft()
        if any(pressed == key for _, pressed in self._presses):
            while (press := self._presses.popleft())[1] != key:
                pass
            self.figures.input_ms.append((now_s - press[0]) * 1000.0)

    async def _think(self, socket: ClientConnection) -> None:
        """Decide on what is seen now and tap that key."""
        seen = self._seen
        if seen is None:
            return
        await asyncio.sleep(self.rng.uniform(*REACTION_OF_TICK) * self._tick_s)
        seen.state()
        key = await asyncio.get_running_loop().run_in_executor(self.thinks, seen.decide)
        if key is None:
            return
        self._presses.append((time.monotonic(), key))
        try:
            await self._key(socket, key, True)
            await asyncio.sleep(TAP_OF_TICK * self._tick_s)
            await self._key(socket, key, False)
        except ConnectionClosed:
            return

    async def _key(self, socket: ClientConnection, key: str, down: bool) -> None:
        seq, self._seq = self._seq, self._seq + 1
        await _send(socket, Key(key, down, seq, time.monotonic() * 1000.0))

    async def _ping(self, socket: ClientConnection) -> None:
        try:
            while True:
                await _send(socket, Ping(time.monotonic() * 1000.0, None))
                await asyncio.sleep(PING_EVERY_S)
        except ConnectionClosed:
            return


async def _send(socket: ClientConnection, message: Incoming) -> None:
    await socket.send(encode_incoming(message))


def _read(text: str | bytes) -> dict[str, Any]:
    """A server's message, checked against the protocol's table."""
    try:
        return parse_outgoing(text)
    except MessageError as error:
        raise RoundLost(f"the server sent what the protocol does not know: {error}") from None
