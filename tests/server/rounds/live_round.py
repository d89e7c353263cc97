"""Matches for tests: an event loop whose time is the test's, browsers and a store that keep what they get."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from typing import Any

import numpy as np

from galley.kitchen import EAST, STAY, Kitchen, Layout
from galley.protocol.codec import parse_outgoing
from galley.protocol.messages import Key, Release
from galley.records import ClockRow, KeyRow, Lease, PauseRow, TickRow
from galley.server.clock import Clock
from galley.server.rounds.match import Match
from galley.server.rounds.minds import Answer
from galley.server.rounds.person import Person
from galley.server.rounds.round_journal import RoundJournal, SentAt
from galley.server.rounds.round_kitchen import caught_up
from galley.server.rounds.round_spec import RoundSpec

LAYOUT = """
    XXPXX
    O  2O
    X1  X
    XDXSX
"""
TICK_S = 0.15


class Loop(asyncio.SelectorEventLoop):
    """An event loop that never waits: when nothing is left to do, it is later."""

    def __init__(self) -> None:
        super().__init__()
        self.now_s = 1000.0

    def time(self) -> float:
        return self.now_s

    def _run_once(self) -> None:
        due = [handle.when() for handle in self._scheduled if not handle.cancelled()]  # type: ignore[attr-defined]
        if due and not self._ready:  # type: ignore[attr-defined]
            self.now_s = max(self.now_s, min(due))
        super()._run_once()  # type: ignore[misc]


class Ticking(Clock):
    """The clock of such a loop; its epoch is its zero."""

    def now(self) -> float:
        return asyncio.get_running_loop().time()

    def ms(self, at_s: float | None = None) -> float:
        return (self.now() if at_s is None else at_s) * 1000.0


class Tab:
    """A browser that keeps what it is sent; `slow_s` passes before the socket takes a frame."""

    def __init__(self, tab: str = "one", slow_s: float = 0.0) -> None:
        self.tab = tab
        self.messages: list[dict[str, Any]] = []
        self.closed: int | None = None
        self._slow_s = slow_s

    def send(self, text: str, sent_at: SentAt | None = None) -> None:
        self.messages.append(parse_outgoing(text))
        if sent_at is not None:
            loop = asyncio.get_running_loop()

            def hand() -> None:
                sent_at.at_s = loop.time()

            loop.call_later(self._slow_s, hand)

    def close(self, code: int) -> None:
        self.closed = code

    def of(self, kind: str) -> list[dict[str, Any]]:
        return [message for message in self.messages if message["type"] == kind]


class Kept:
    """A store that keeps rows in lists."""

    def __init__(self) -> None:
        self.ticks: list[TickRow] = []
        self.keys: list[KeyRow] = []
        self.pauses: dict[float, PauseRow] = {}
        self.clocks: list[ClockRow] = []

    def journal(
        self,
        round_id: int,
        ticks: Sequence[TickRow] = (),
        keys: Sequence[KeyRow] = (),
        pauses: Sequence[PauseRow] = (),
        clocks: Sequence[ClockRow] = (),
        lease: Lease | None = None,
    ) -> None:
        self.ticks += ticks
        self.keys += keys
        self.pauses |= {row.started_ms: row for row in pauses}
        self.clocks += clocks


class Asked:
    """A question that is answered, or never is."""

    def __init__(self, answer: Answer | None) -> None:
        self.answer = answer
        self.late_action = STAY


class Answering:
    """A mind without a thread: `decide(tick)` gives the answer at once."""

    def __init__(self, decide: Callable[[int], Answer | None]) -> None:
        self.decide = decide
        self.seen: list[tuple[int, tuple[int, int] | None]] = []
        self.restarts: list[tuple[int, int]] = []

    def ask(self, tick: int, state: Any, seen: Any) -> Asked:
        self.seen.append((tick, None if seen is None else seen[1]))
        return Asked(self.decide(tick))

    def restart(self, layout: Layout, seat: int, seed: int) -> None:
        self.restarts += [(seat, seed)]

    def stop(self) -> None:
        pass


class Round:
    """A match with everything around it: one person at seat 0 with an agent, or two people."""

    def __init__(
        self,
        horizon: int = 20,
        decide: Callable[[int], Answer | None] = lambda tick: Answer(EAST, 2.0, None),
        played: Sequence[tuple[int, int]] = (),
        countdown_s: int = 3,
        stagger: float = 0.25,
        finish_fails: Exception | None = None,
        people: int = 1,
        episodes: int = 1,
        **spec: Any,
    ) -> None:
        layout = Layout.from_ascii("test", LAYOUT, horizon_ticks=horizon)
        self.round_kitchen = caught_up(layout, episodes, np.array(played, dtype=np.uint8).reshape(-1, 2))
        self.kept = Kept()
        self.mind = Answering(decide)
        self.ends: list[str] = []
        self.idle: list[Match] = []
        self.away: list[tuple[int, float, float | None]] = []
        self._finish_fails = finish_fails
        self.person = Person(0, 1, ("orange", "blue"), "/v/x", repeats=spec.get("input_mode") != "press")
        self.other = Person(1, 2, ("green", "red"), "/v/y")
        settings = {"seeds": (1,) * episodes, **spec}
        self.match = Match(
            RoundSpec(7, 150, 160, 1, 2, False, countdown_s, 60, **settings),
            self.round_kitchen,
            (self.person, self.other if people == 2 else self.mind),  # type: ignore[arg-type]
            RoundJournal(self.kept, Ticking(), 7),
            Ticking(),
            self,
            stagger=stagger,
        )
        self.seq = 0

    async def finish(self, match: Match, outcome: str) -> None:
        if self._finish_fails is not None:
            raise self._finish_fails
        self.ends.append(outcome)

    async def stand_in(self, match: Match, person: Person, agent: str) -> Any:
        assert agent == match.spec.stand_in
        return self.mind

    def forget(self, match: Match) -> None:
        self.idle.append(match)

    def hidden(self, match: Match, person: Person, since_ms: float, until_ms: float | None) -> None:
        self.away.append((person.seat, since_ms, until_ms))

    @property
    def kitchen(self) -> Kitchen:
        return self.round_kitchen.kitchen

    def join(self, tab: Tab) -> None:
        self.match.join(self.person, tab)

    def ready(self) -> None:
        self.match.ready(self.person)

    def key(self, name: str, down: bool, person: Person | None = None) -> None:
        self.seq += 1
        now = asyncio.get_running_loop().time()
        self.match.key(person or self.person, Key(name, down, self.seq, 1.0), now)

    def release(self, reason: str) -> None:
        self.seq += 1
        now = asyncio.get_running_loop().time()
        self.match.release(self.person, Release(reason, self.seq, 1.0), now)


def run(test: Coroutine[Any, Any, None]) -> None:
    with asyncio.Runner(loop_factory=Loop) as runner:
        runner.run(test)


async def until_tick(round_: Round, tick: int) -> None:
    while round_.kitchen.tick < tick:
        await asyncio.sleep(0.01)
