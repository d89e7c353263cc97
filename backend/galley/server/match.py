"""A live round: its phases and its clock. Runs on the event loop and never waits there."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Protocol

from galley.kitchen import STAY, Kitchen
from galley.records import PauseRow
from galley.server import wire
from galley.server.clock import Clock, first_deadline
from galley.server.input import KeyState
from galley.server.journal import Handed, Played, RoundJournal
from galley.server.scene import Scene, happenings
from galley.server.thinking import Mind

LOG = logging.getLogger(__name__)
LEFT = "left"
RESTART = "restart"


@dataclass(frozen=True, slots=True)
class RoundSpec:
    """What is fixed about a round before it is played, besides its kitchen and the agent's mind."""

    round_id: int
    tick_ms: int
    human_seat: int
    hats: tuple[str, str]
    goal: int | None
    round_no: int
    of: int
    tutorial: bool
    countdown_s: int
    abandon_after_s: float
    next_url: str


class Connection(Protocol):
    """A browser's socket as a match sees it: nothing here waits."""

    tab: str

    def send(self, text: str, handed: Handed | None = None) -> None:
        """Queue a frame."""

    def close(self, code: int) -> None:
        """Close once everything queued is sent."""


class Match:
    """One round from its first connection to its end.

    Phases: waiting -> countdown -> playing -> ended. A connection lost in countdown or play pauses it, and
    `ready` leads from paused to countdown again; a pause that lasts too long ends it as abandoned. Tick k is
    due at `deadline(k)`. Each start, and each going on after a pause, fixes the deadlines of all ticks left,
    at the phase of the tick that this match was given (`stagger` in [0, 1)), so that matches do not tick in
    step. `finish` is awaited once with the outcome when the round is over; `ended` is sent after it. `idle`
    is called when nobody was connected for long before the first tick.
    """

    def __init__(
        self,
        spec: RoundSpec,
        kitchen: Kitchen,
        mind: Mind,
        journal: RoundJournal,
        clock: Clock,
        *,
        stagger: float,
        finish: Callable[[Match, str], Awaitable[None]],
        idle: Callable[[Match], None],
    ) -> None:
        self.spec = spec
        self.kitchen = kitchen
        self.scene = Scene(kitchen.layout)
        self.mind = mind
        self.phase = "waiting"
        self.outcome: str | None = None
        self.connection: Connection | None = None
        self.keys = KeyState()
        self.journal = journal
        self._clock = clock
        self._loop = asyncio.get_running_loop()
        self._tick_s = spec.tick_ms / 1000.0
        self._stagger = stagger
        self._finish = finish
        self._idle = idle
        self._timer: asyncio.TimerHandle | None = None
        self._absence: asyncio.TimerHandle | None = None
        self._give_up_at_s = 0.0
        self._start_s = 0.0
        self._start_tick = kitchen.tick
        self._pause: PauseRow | None = None
        self._ending: asyncio.Task[None] | None = None
        self._state = kitchen.state.copy()
        self._question = mind.ask(kitchen.tick, self._state, None)
        if kitchen.done:
            self.end("finished")
        elif kitchen.tick > 0:
            self._stand_still(RESTART)
        else:
            self._await_return()

    # ---- what the browser does -----------------------------------------------------------------------------

    def join(self, connection: Connection) -> None:
        """Take a connection that has said hello: the newest wins, an older one is told and closed."""
        older = self.connection
        if older is not None:
            if older.tab != connection.tab:
                older.send(wire.encode("elsewhere"))
            older.close(wire.CLOSE_REPLACED)
            self.leave(older)
        self.connection = connection
        if self.phase == "waiting":
            self._cancel_absence()
        self.show()

    def leave(self, connection: Connection, reason: str = LEFT) -> None:
        """Lose a connection; nothing happens when another has taken its place."""
        if self.connection is not connection:
            return
        self.connection = None
        if self.phase == "playing" or (self.phase == "countdown" and self.kitchen.tick > 0):
            self._stand_still(reason)
        elif self.phase in ("waiting", "countdown"):
            self._cancel_timer()
            self.phase = "waiting"
            self._await_return()

    def show(self) -> None:
        """Send the whole picture and what belongs to the phase."""
        rules = self.scene.layout.rules
        spec = self.spec
        self._send(
            "keyframe",
            phase=self.phase,
            tick=self.kitchen.tick,
            horizon=rules.horizon_ticks,
            tick_ms=spec.tick_ms,
            seat=spec.human_seat,
            hats=spec.hats,
            grid=self.scene.grid,
            cook_time=rules.cook_time_ticks,
            goal=spec.goal,
            round=spec.round_no,
            of=spec.of,
            tutorial=spec.tutorial,
            **self.scene.whole(self._state),
        )
        if self.phase == "paused" and self._pause is not None:
            left_s = max(0, math.ceil(self._give_up_at_s - self._loop.time()))
            self._send("paused", reason=self._pause.reason, seconds_left=left_s)
        elif self._ending is not None and self._ending.done():
            self._say_ended()

    def ready(self) -> None:
        """Begin the countdown. Raises: MessageError when the round is not waiting for that."""
        if self.phase not in ("waiting", "paused"):
            raise wire.MessageError(f"the round is not waiting for ready: it is {self.phase}")
        self._cancel_absence()
        self.keys.clear()
        self.phase = "countdown"
        self.show()
        self._count(self.spec.countdown_s)

    def key(self, message: wire.Key, arrival_s: float) -> None:
        """A key went down or up. Raises: MessageError when nothing is being played."""
        if self.phase not in ("countdown", "playing"):
            raise wire.MessageError(f"no key counts now: the round is {self.phase}")
        if message.down:
            self.keys.press(message.key)
        else:
            self.keys.let_go(message.key)
        self.journal.key(message, arrival_s, self.kitchen.tick)

    def release(self, message: wire.Release, arrival_s: float) -> None:
        """All keys were let go; outside of play there is none to let go of."""
        if self.phase in ("countdown", "playing"):
            self.keys.let_go_all()
            self.journal.key(message, arrival_s, self.kitchen.tick)

    def ping(self, message: wire.Ping, arrival_s: float) -> None:
        """Answer a ping and note it."""
        self._send("pong", client_ms=message.client_ms, server_ms=self._clock.ms(arrival_s))
        if self.phase != "ended":
            self.journal.ping(message, arrival_s)

    # ---- the clock -----------------------------------------------------------------------------------------

    def deadline(self, tick: int) -> float:
        """When a tick is due while playing, in seconds of the event loop's clock."""
        return self._start_s + (tick - self._start_tick) * self._tick_s

    def _count(self, seconds: int) -> None:
        if seconds > 0:
            self._send("countdown", seconds=seconds)
            self._timer = self._loop.call_later(1.0, self._count, seconds - 1)
            return
        self.keys.forget_waiting()
        self.phase = "playing"
        self._start_tick = self.kitchen.tick
        # The first tick is due a whole tick from now at the earliest, so that keys can reach it.
        self._start_s = first_deadline(self._loop.time() + self._tick_s, self._stagger, self._tick_s)
        if self._pause is not None:
            self.journal.goes_on(self._pause)
            self._pause = None
        self.show()
        self._timer = self._loop.call_at(self._start_s, self._tick)

    def _tick(self) -> None:
        tick = self.kitchen.tick
        deadline_s = self.deadline(tick)
        human, agent = self.spec.human_seat, 1 - self.spec.human_seat
        answer = self._question.answer
        actions = [STAY, STAY]
        actions[human] = self.keys.take()
        if answer is not None and answer.action is not None:
            actions[agent] = answer.action
        joint = (actions[0], actions[1])
        before = self._state
        self.kitchen.step(*joint)
        after = self._state = self.kitchen.state.copy()
        changes = self.scene.changes(before, after)
        text = wire.encode("tick", tick=tick + 1, events=happenings(self.kitchen.events), **changes)
        handed = Handed()
        if self.connection is not None:
            self.connection.send(text, handed)
        decision_ms, fault = (None, None) if answer is None else (answer.decision_ms, answer.fault)
        self.journal.played(Played(tick, joint, deadline_s, self._loop.time(), handed, decision_ms, fault))
        if self.kitchen.done:
            self.end("finished")
            return
        self._question = self.mind.ask(tick + 1, after, (before, joint))
        self._timer = self._loop.call_at(self.deadline(tick + 1), self._tick)

    def _stand_still(self, reason: str) -> None:
        self._cancel_timer()
        self.journal.write()
        self.keys.clear()
        self.phase = "paused"
        if self._pause is None:
            self._pause = self.journal.pause(self.kitchen.tick, reason)
        self._await_return()

    def _await_return(self) -> None:
        self._cancel_absence()
        self._give_up_at_s = self._loop.time() + self.spec.abandon_after_s
        self._absence = self._loop.call_at(self._give_up_at_s, self._give_up)

    def _give_up(self) -> None:
        self._absence = None
        if self.phase == "paused":
            self.end("abandoned")
        elif self.phase == "waiting" and self.connection is None:
            self._idle(self)

    # ---- the end -------------------------------------------------------------------------------------------

    def end(self, outcome: str) -> None:
        """End the round, if it has not ended yet; `ended` tells when that is stored."""
        if self.phase == "ended":
            return
        self._cancel_timer()
        self._cancel_absence()
        self.phase = "ended"
        self.outcome = outcome
        self._ending = self._loop.create_task(self._close(outcome))

    async def ended(self) -> None:
        """Return when a round that is over is stored; at once when it is not over."""
        if self._ending is not None:
            await asyncio.wait([self._ending])

    async def _close(self, outcome: str) -> None:
        # A little later, so that the last tick has reached the socket and its lateness is known.
        await asyncio.sleep(0.01)
        self.journal.write()
        try:
            await self._finish(self, outcome)
        except Exception:  # the round is in the journal; opening the page again tries to close it again
            LOG.exception("round %d could not be closed", self.spec.round_id)
            if self.connection is not None:
                self.connection.close(wire.CLOSE_ENDED)
            return
        self._say_ended()

    def _say_ended(self) -> None:
        self._send("ended", outcome=self.outcome, score=self.kitchen.score, next=self.spec.next_url)

    def stop(self) -> None:
        """Stop for a shutdown: what was played is journalled, a round in play is left paused."""
        if self.phase == "playing" or (self.phase == "countdown" and self.kitchen.tick > 0):
            self._stand_still(RESTART)
        self._cancel_timer()
        self._cancel_absence()

    # ---- small parts ---------------------------------------------------------------------------------------

    def _send(self, name: str, **fields: Any) -> None:
        if self.connection is not None:
            self.connection.send(wire.encode(name, **fields))

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _cancel_absence(self) -> None:
        if self._absence is not None:
            self._absence.cancel()
            self._absence = None
