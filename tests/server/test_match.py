"""A round's phases and clock, on an event loop whose time is the test's."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Coroutine, Sequence
from typing import Any

import numpy as np
import pytest

from galley.kitchen import EAST, INTERACT, NORTH, STAY, WEST, Kitchen, Layout
from galley.records import ClockRow, KeyRow, PauseRow, TickRow
from galley.server import wire
from galley.server.clock import Clock, Stagger, first_deadline
from galley.server.journal import Handed, RoundJournal
from galley.server.match import Match, RoundSpec
from galley.server.thinking import Answer

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

    def send(self, text: str, handed: Handed | None = None) -> None:
        self.messages.append(json.loads(text))
        if handed is not None:
            loop = asyncio.get_running_loop()

            def hand() -> None:
                handed.at_s = loop.time()

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
    ) -> None:
        self.ticks += ticks
        self.keys += keys
        self.pauses |= {row.started_ms: row for row in pauses}
        self.clocks += clocks


class Asked:
    """A question that is answered, or never is."""

    def __init__(self, answer: Answer | None) -> None:
        self.answer = answer


class Answering:
    """A mind without a thread: `decide(tick)` gives the answer at once."""

    def __init__(self, decide: Callable[[int], Answer | None]) -> None:
        self.decide = decide
        self.seen: list[tuple[int, tuple[int, int] | None]] = []

    def ask(self, tick: int, state: Any, seen: Any) -> Asked:
        self.seen.append((tick, None if seen is None else seen[1]))
        return Asked(self.decide(tick))


class Round:
    """A match with everything around it."""

    def __init__(
        self,
        horizon: int = 20,
        decide: Callable[[int], Answer | None] = lambda tick: Answer(EAST, 2.0, None),
        played: Sequence[tuple[int, int]] = (),
        countdown_s: int = 3,
        stagger: float = 0.25,
        finish_fails: bool = False,
    ) -> None:
        self.kitchen = Kitchen(Layout.from_ascii("test", LAYOUT, horizon_ticks=horizon))
        for joint in played:
            self.kitchen.step(*joint)
        self.kept = Kept()
        self.mind = Answering(decide)
        self.ends: list[str] = []
        self.idle: list[Match] = []

        async def finish(match: Match, outcome: str) -> None:
            if finish_fails:
                raise OSError("the disk is full")
            self.ends.append(outcome)

        spec = RoundSpec(
            7, 150, 0, ("orange", "blue"), 160, 1, 2, False, countdown_s, abandon_after_s=60, next_url="/v/x"
        )
        self.match = Match(
            spec,
            self.kitchen,
            self.mind,  # type: ignore[arg-type]
            RoundJournal(self.kept, Ticking(), 7, 0),
            Ticking(),
            stagger=stagger,
            finish=finish,
            idle=self.idle.append,
        )
        self.seq = 0

    def key(self, name: str, down: bool) -> None:
        self.seq += 1
        now = asyncio.get_running_loop().time()
        self.match.key(wire.Key(name, down, self.seq, 1.0), now)


def run(test: Coroutine[Any, Any, None]) -> None:
    with asyncio.Runner(loop_factory=Loop) as runner:
        runner.run(test)


async def until_tick(round_: Round, tick: int) -> None:
    while round_.kitchen.tick < tick:
        await asyncio.sleep(0.01)


def test_a_round_is_exactly_its_horizon_at_exact_deadlines() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=400), Tab()
        round_.match.join(tab)
        assert [m["type"] for m in tab.messages] == ["keyframe"]
        assert tab.messages[0]["phase"] == "waiting"
        round_.match.ready()
        await until_tick(round_, 400)
        await asyncio.sleep(1)
        assert [m["seconds"] for m in tab.of("countdown")] == [3, 2, 1]
        assert [m["tick"] for m in tab.of("tick")] == list(range(1, 401))
        rows = round_.kept.ticks
        assert [row.tick for row in rows] == list(range(400))
        assert np.allclose(np.diff([row.deadline_ms for row in rows]), 150.0, atol=1e-6)
        assert (rows[0].deadline_ms / 150.0) % 1.0 == pytest.approx(0.25)
        assert rows[0].deadline_ms >= 1_003_000 + 150
        assert all(row.lateness_ms == pytest.approx(0.0, abs=1e-6) for row in rows)
        assert round_.ends == ["finished"]
        assert tab.of("ended") == [{"type": "ended", "outcome": "finished", "score": 0, "next": "/v/x"}]

    run(test())


def test_a_stall_costs_no_tick_and_moves_no_deadline() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=20), Tab()
        round_.match.join(tab)
        round_.match.ready()
        await until_tick(round_, 5)
        loop = asyncio.get_running_loop()
        assert isinstance(loop, Loop)
        loop.now_s += 0.7  # the machine was busy
        await until_tick(round_, 20)
        await asyncio.sleep(1)
        rows = round_.kept.ticks
        assert [row.tick for row in rows] == list(range(20))
        assert np.allclose(np.diff([row.deadline_ms for row in rows]), 150.0)
        late = [row.lateness_ms for row in rows]
        assert max(late) > 500
        assert late[-1] == pytest.approx(0.0, abs=1e-6)

    run(test())


def test_lateness_counts_until_the_socket_has_the_tick() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=3), Tab(slow_s=0.004)
        round_.match.join(tab)
        round_.match.ready()
        await until_tick(round_, 3)
        await asyncio.sleep(1)
        assert [row.lateness_ms for row in round_.kept.ticks] == pytest.approx([4.0] * 3)

    run(test())


def test_the_agent_is_asked_right_after_the_tick_before_and_shown_what_happened() -> None:
    async def test() -> None:
        round_ = Round(horizon=3)
        round_.match.join(Tab())
        round_.match.ready()
        assert round_.mind.seen == [(0, None)]
        await until_tick(round_, 1)
        assert round_.mind.seen == [(0, None), (1, (STAY, EAST))]
        await until_tick(round_, 3)
        assert round_.mind.seen[2:] == [(2, (STAY, EAST))]

    run(test())


def test_a_late_agent_stays_and_is_recorded_as_late() -> None:
    async def test() -> None:
        def decide(tick: int) -> Answer | None:
            return None if tick == 1 else Answer(WEST, 3.0, None)

        round_ = Round(horizon=3, decide=decide)
        round_.match.join(Tab())
        round_.match.ready()
        await until_tick(round_, 3)
        await asyncio.sleep(1)
        rows = round_.kept.ticks
        assert [(row.action_1, row.late, row.decision_ms) for row in rows] == [
            (WEST, False, 3.0),
            (STAY, True, None),
            (WEST, False, 3.0),
        ]

    run(test())


def test_an_agent_at_fault_stays_and_the_fault_is_recorded() -> None:
    async def test() -> None:
        round_ = Round(horizon=2, decide=lambda tick: Answer(None, 1.0, "error"))
        round_.match.join(Tab())
        round_.match.ready()
        await until_tick(round_, 2)
        await asyncio.sleep(1)
        assert [(r.action_1, r.late, r.fault) for r in round_.kept.ticks] == [(STAY, False, "error")] * 2

    run(test())


def test_keys_become_actions_and_are_recorded_with_their_tick() -> None:
    async def test() -> None:
        round_ = Round(horizon=8)
        round_.match.join(Tab())
        round_.match.ready()
        await until_tick(round_, 1)
        round_.key("right", True)
        await until_tick(round_, 3)
        round_.key("right", False)
        round_.key("interact", True)
        await until_tick(round_, 5)
        round_.match.release(wire.Release("blur", 9, 1.0), asyncio.get_running_loop().time())
        await until_tick(round_, 8)
        await asyncio.sleep(1)
        taken = [row.action_0 for row in round_.kept.ticks]
        assert taken == [STAY, EAST, EAST, INTERACT, STAY, STAY, STAY, STAY]
        keys = [(row.key, row.down, row.tick_applied) for row in round_.kept.keys]
        assert keys == [("right", True, 1), ("right", False, 3), ("interact", True, 3), ("release", False, 5)]

    run(test())


def test_a_direction_held_in_the_countdown_acts_at_the_first_tick_and_a_tap_does_not() -> None:
    async def test() -> None:
        round_ = Round(horizon=2)
        round_.match.join(Tab())
        with pytest.raises(wire.MessageError, match="waiting"):
            round_.key("up", True)
        round_.match.ready()
        round_.key("interact", True)
        round_.key("up", True)
        await until_tick(round_, 2)
        await asyncio.sleep(1)
        assert [row.action_0 for row in round_.kept.ticks] == [NORTH, NORTH]

    run(test())


def test_a_lost_connection_pauses_and_ready_goes_on_with_all_its_ticks() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=20), Tab()
        round_.match.join(tab)
        round_.match.ready()
        await until_tick(round_, 8)
        round_.key("right", True)
        round_.match.leave(tab)
        assert round_.match.phase == "paused"
        await asyncio.sleep(30)
        assert round_.kitchen.tick == 8
        back = Tab("two")
        round_.match.join(back)
        assert back.messages[0]["phase"] == "paused"
        assert back.messages[0]["tick"] == 8
        assert back.messages[1] == {"type": "paused", "reason": "left", "seconds_left": 30}
        round_.match.ready()
        await until_tick(round_, 20)
        await asyncio.sleep(1)
        rows = round_.kept.ticks
        assert [row.tick for row in rows] == list(range(20))
        gaps = np.diff([row.deadline_ms for row in rows])
        assert np.allclose(np.delete(gaps, 7), 150.0)
        assert gaps[7] > 33_000
        assert rows[8].action_0 == STAY, "keys are let go at a pause"
        assert (rows[8].deadline_ms / 150) % 1 == pytest.approx((rows[0].deadline_ms / 150) % 1)
        (pause,) = round_.kept.pauses.values()
        assert (pause.tick, pause.reason) == (8, "left")
        assert pause.ended_ms == pytest.approx(pause.started_ms + 33_000)
        assert round_.ends == ["finished"]

    run(test())


def test_a_connection_lost_in_the_countdown_before_the_first_tick_is_no_pause() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=2), Tab()
        round_.match.join(tab)
        round_.match.ready()
        await asyncio.sleep(1.5)
        round_.match.leave(tab)
        assert round_.match.phase == "waiting"
        await asyncio.sleep(10)
        assert round_.kitchen.tick == 0
        assert not round_.kept.pauses

    run(test())


def test_leaving_again_in_the_countdown_after_a_pause_is_one_pause() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=9), Tab()
        round_.match.join(tab)
        round_.match.ready()
        await until_tick(round_, 4)
        for _ in range(2):
            round_.match.leave(tab)
            await asyncio.sleep(5)
            round_.match.join(tab)
            round_.match.ready()
            await asyncio.sleep(1)
        await until_tick(round_, 9)
        assert len(round_.kept.pauses) == 1

    run(test())


def test_a_pause_that_is_too_long_abandons_the_round() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        round_.match.join(tab)
        round_.match.ready()
        await until_tick(round_, 8)
        round_.match.leave(tab)
        await asyncio.sleep(59)
        assert round_.match.phase == "paused"
        await asyncio.sleep(2)
        assert (round_.match.phase, round_.ends) == ("ended", ["abandoned"])
        assert len(round_.kept.ticks) == 8
        back = Tab()
        round_.match.join(back)
        assert back.of("ended")[0]["outcome"] == "abandoned"
        with pytest.raises(wire.MessageError, match="ended"):
            round_.match.ready()

    run(test())


def test_a_round_that_nobody_came_to_is_let_go_of_but_not_ended() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        round_.match.join(tab)
        await asyncio.sleep(100)
        assert not round_.idle, "somebody reads the start card"
        round_.match.leave(tab)
        await asyncio.sleep(61)
        assert round_.idle == [round_.match]
        assert not round_.ends

    run(test())


def test_the_newest_tab_wins_and_the_older_is_told() -> None:
    async def test() -> None:
        round_, old, new = Round(), Tab("old"), Tab("new")
        round_.match.join(old)
        round_.match.ready()
        await until_tick(round_, 3)
        round_.match.join(new)
        assert old.messages[-1] == {"type": "elsewhere"}
        assert old.closed == wire.CLOSE_REPLACED
        assert new.messages[0]["phase"] == "paused"
        round_.match.leave(old)
        assert round_.match.connection is new
        round_.match.ready()
        await until_tick(round_, 20)
        await asyncio.sleep(1)
        assert len(old.of("tick")) == 3
        assert len(new.of("tick")) == 17

    run(test())


def test_the_same_tab_coming_back_is_not_told_of_another() -> None:
    async def test() -> None:
        round_, dead, alive = Round(), Tab("same"), Tab("same")
        round_.match.join(dead)
        round_.match.join(alive)
        assert not dead.of("elsewhere")
        assert dead.closed == wire.CLOSE_REPLACED

    run(test())


def test_ready_out_of_turn_is_refused_and_changes_nothing() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=5), Tab()
        round_.match.join(tab)
        round_.match.ready()
        with pytest.raises(wire.MessageError, match="countdown"):
            round_.match.ready()
        await until_tick(round_, 2)
        with pytest.raises(wire.MessageError, match="playing"):
            round_.match.ready()
        await until_tick(round_, 5)
        await asyncio.sleep(1)
        assert len(round_.kept.ticks) == 5

    run(test())


def test_a_round_taken_up_again_waits_paused_and_plays_the_rest() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=10, played=[(EAST, STAY)] * 4), Tab()
        assert round_.match.phase == "paused"
        round_.match.join(tab)
        assert tab.messages[0]["tick"] == 4
        assert tab.of("paused")[0]["reason"] == "restart"
        round_.match.ready()
        await until_tick(round_, 10)
        await asyncio.sleep(1)
        assert [row.tick for row in round_.kept.ticks] == [4, 5, 6, 7, 8, 9]

    run(test())


def test_a_round_taken_up_after_its_last_tick_is_closed_at_once() -> None:
    async def test() -> None:
        round_ = Round(horizon=4, played=[(STAY, STAY)] * 4)
        await round_.match.ended()
        assert round_.ends == ["finished"]

    run(test())


def test_a_shutdown_journals_the_last_tick_and_marks_the_pause() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        round_.match.join(tab)
        round_.match.ready()
        await until_tick(round_, 6)
        round_.match.stop()
        await asyncio.sleep(100)
        assert [row.tick for row in round_.kept.ticks] == list(range(6))
        assert [pause.reason for pause in round_.kept.pauses.values()] == ["restart"]
        assert not round_.ends

    run(test())


def test_a_round_that_cannot_be_closed_closes_the_page_and_is_not_said_to_have_ended(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def test() -> None:
        round_, tab = Round(horizon=2, finish_fails=True), Tab()
        round_.match.join(tab)
        round_.match.ready()
        await until_tick(round_, 2)
        await asyncio.sleep(1)
        assert tab.closed == wire.CLOSE_ENDED
        assert not tab.of("ended")

    run(test())
    assert "could not be closed" in caplog.text


def test_pings_are_answered_and_kept_once_a_second() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        round_.match.join(tab)
        for number in range(30):
            round_.match.ping(wire.Ping(float(number), None), asyncio.get_running_loop().time())
            await asyncio.sleep(0.1)
        assert len(tab.of("pong")) == 30
        assert [row.client_ms for row in round_.kept.clocks] == pytest.approx([0.0, 10.0, 20.0], abs=1.01)

    run(test())


def test_every_message_of_the_server_is_as_the_table_says() -> None:
    async def test() -> None:
        round_, tab, other = Round(horizon=20), Tab("one"), Tab("two")
        round_.match.join(tab)
        round_.match.ready()
        await until_tick(round_, 3)
        round_.key("right", True)
        await until_tick(round_, 9)
        round_.match.ping(wire.Ping(1.0, 2.0), 5.0)
        round_.match.join(other)
        round_.match.ready()
        await until_tick(round_, 20)
        await asyncio.sleep(1)
        seen = set()
        for message in [*tab.messages, *other.messages]:
            row = wire.SERVER[message.pop("type")]
            seen.add(row.name)
            assert set(message) == {field.name for field in row.fields}
            for field in row.fields:
                assert field.holds(message[field.name]), (row.name, field.name, message[field.name])
        assert seen == set(wire.SERVER) - {"refused"}

    run(test())


def test_phases_of_rounds_spread_over_the_tick() -> None:
    stagger = Stagger()
    phases = sorted(stagger.phase() for _ in range(50))
    gaps = np.diff([*phases, phases[0] + 1])
    assert gaps.max() < 2.7 / 50
    assert gaps.min() > 0.3 / 50


@pytest.mark.parametrize("earliest", [0.0, 0.149, 0.15, 12.3456, 99_999.999])
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.999])
def test_the_first_deadline_is_the_next_one_of_its_phase(earliest: float, phase: float) -> None:
    found = first_deadline(earliest, phase, TICK_S)
    assert earliest - 1e-9 <= found < earliest + TICK_S + 1e-9
    off = (found / TICK_S - phase) % 1.0
    assert min(off, 1.0 - off) == pytest.approx(0.0, abs=1e-6)
