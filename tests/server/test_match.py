"""A round's phases and clock, on an event loop whose time is the test's."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Coroutine, Sequence
from typing import Any

import numpy as np
import pytest

from galley.kitchen import EAST, INTERACT, NORTH, STAY, WEST, Kitchen, Layout
from galley.records import ClockRow, KeyRow, Lease, LeaseLost, PauseRow, TickRow
from galley.server import wire
from galley.server.catching_up import caught_up
from galley.server.clock import Clock, Stagger, first_deadline
from galley.server.journal import Handed, RoundJournal
from galley.server.match import Match, RoundSpec
from galley.server.person import Person
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
        self.course = caught_up(layout, episodes, np.array(played, dtype=np.uint8).reshape(-1, 2))
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
            self.course,
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

    async def stand_in(self, match: Match, person: Person) -> Any:
        return self.mind

    def forget(self, match: Match) -> None:
        self.idle.append(match)

    def hidden(self, match: Match, person: Person, since_ms: float, until_ms: float | None) -> None:
        self.away.append((person.seat, since_ms, until_ms))

    @property
    def kitchen(self) -> Kitchen:
        return self.course.kitchen

    def join(self, tab: Tab) -> None:
        self.match.join(self.person, tab)

    def ready(self) -> None:
        self.match.ready(self.person)

    def key(self, name: str, down: bool, person: Person | None = None) -> None:
        self.seq += 1
        now = asyncio.get_running_loop().time()
        self.match.key(person or self.person, wire.Key(name, down, self.seq, 1.0), now)

    def release(self, reason: str) -> None:
        self.seq += 1
        now = asyncio.get_running_loop().time()
        self.match.release(self.person, wire.Release(reason, self.seq, 1.0), now)


def run(test: Coroutine[Any, Any, None]) -> None:
    with asyncio.Runner(loop_factory=Loop) as runner:
        runner.run(test)


async def until_tick(round_: Round, tick: int) -> None:
    while round_.kitchen.tick < tick:
        await asyncio.sleep(0.01)


def test_a_round_is_exactly_its_horizon_at_exact_deadlines() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=400), Tab()
        round_.join(tab)
        assert [m["type"] for m in tab.messages] == ["keyframe"]
        assert tab.messages[0]["phase"] == "waiting"
        round_.ready()
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
        round_.join(tab)
        round_.ready()
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
        round_.join(tab)
        round_.ready()
        await until_tick(round_, 3)
        await asyncio.sleep(1)
        assert [row.lateness_ms for row in round_.kept.ticks] == pytest.approx([4.0] * 3)

    run(test())


def test_the_agent_is_asked_right_after_the_tick_before_and_shown_what_happened() -> None:
    async def test() -> None:
        round_ = Round(horizon=3)
        round_.join(Tab())
        round_.ready()
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
        round_.join(Tab())
        round_.ready()
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
        round_.join(Tab())
        round_.ready()
        await until_tick(round_, 2)
        await asyncio.sleep(1)
        assert [(r.action_1, r.late, r.fault) for r in round_.kept.ticks] == [(STAY, False, "error")] * 2

    run(test())


def test_keys_become_actions_and_are_recorded_with_their_tick() -> None:
    async def test() -> None:
        round_ = Round(horizon=8)
        round_.join(Tab())
        round_.ready()
        await until_tick(round_, 1)
        round_.key("right", True)
        await until_tick(round_, 3)
        round_.key("right", False)
        round_.key("interact", True)
        await until_tick(round_, 5)
        round_.release("blur")
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
        round_.join(Tab())
        with pytest.raises(wire.MessageError, match="waiting"):
            round_.key("up", True)
        round_.ready()
        round_.key("interact", True)
        round_.key("up", True)
        await until_tick(round_, 2)
        await asyncio.sleep(1)
        assert [row.action_0 for row in round_.kept.ticks] == [NORTH, NORTH]

    run(test())


def test_a_lost_connection_pauses_and_ready_goes_on_with_all_its_ticks() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=20), Tab()
        round_.join(tab)
        round_.ready()
        await until_tick(round_, 8)
        round_.key("right", True)
        round_.match.leave(tab)
        assert round_.match.phase == "paused"
        await asyncio.sleep(30)
        assert round_.kitchen.tick == 8
        back = Tab("two")
        round_.join(back)
        assert back.messages[0]["phase"] == "paused"
        assert back.messages[0]["tick"] == 8
        assert back.messages[1] == {"type": "paused", "reason": "left", "seconds_left": 30}
        round_.ready()
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
        round_.join(tab)
        round_.ready()
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
        round_.join(tab)
        round_.ready()
        await until_tick(round_, 4)
        for _ in range(2):
            round_.match.leave(tab)
            await asyncio.sleep(5)
            round_.join(tab)
            round_.ready()
            await asyncio.sleep(1)
        await until_tick(round_, 9)
        assert len(round_.kept.pauses) == 1

    run(test())


def test_a_pause_that_is_too_long_abandons_the_round() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        round_.join(tab)
        round_.ready()
        await until_tick(round_, 8)
        round_.match.leave(tab)
        await asyncio.sleep(59)
        assert round_.match.phase == "paused"
        await asyncio.sleep(2)
        assert (round_.match.phase, round_.ends) == ("ended", ["abandoned"])
        assert len(round_.kept.ticks) == 8
        back = Tab()
        round_.join(back)
        assert back.of("ended")[0]["outcome"] == "abandoned"
        with pytest.raises(wire.MessageError, match="ended"):
            round_.ready()

    run(test())


def test_a_round_that_nobody_came_to_is_let_go_of_but_not_ended() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        round_.join(tab)
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
        round_.join(old)
        round_.ready()
        await until_tick(round_, 3)
        round_.join(new)
        assert old.messages[-1] == {"type": "elsewhere"}
        assert old.closed == wire.CLOSE_REPLACED
        assert new.messages[0]["phase"] == "paused"
        round_.match.leave(old)
        assert round_.person.connection is new
        round_.ready()
        await until_tick(round_, 20)
        await asyncio.sleep(1)
        assert len(old.of("tick")) == 3
        assert len(new.of("tick")) == 17

    run(test())


def test_the_same_tab_coming_back_is_not_told_of_another() -> None:
    async def test() -> None:
        round_, dead, alive = Round(), Tab("same"), Tab("same")
        round_.join(dead)
        round_.join(alive)
        assert not dead.of("elsewhere")
        assert dead.closed == wire.CLOSE_REPLACED

    run(test())


def test_ready_out_of_turn_is_refused_and_changes_nothing() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=5), Tab()
        round_.join(tab)
        round_.ready()
        with pytest.raises(wire.MessageError, match="countdown"):
            round_.ready()
        await until_tick(round_, 2)
        with pytest.raises(wire.MessageError, match="playing"):
            round_.ready()
        await until_tick(round_, 5)
        await asyncio.sleep(1)
        assert len(round_.kept.ticks) == 5

    run(test())


def test_a_round_taken_up_again_waits_paused_and_plays_the_rest() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=10, played=[(EAST, STAY)] * 4), Tab()
        assert round_.match.phase == "paused"
        round_.join(tab)
        assert tab.messages[0]["tick"] == 4
        assert tab.of("paused")[0]["reason"] == "restart"
        round_.ready()
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
        round_.join(tab)
        round_.ready()
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
        round_, tab = Round(horizon=2, finish_fails=OSError("the disk is full")), Tab()
        round_.join(tab)
        round_.ready()
        await until_tick(round_, 2)
        await asyncio.sleep(1)
        assert tab.closed == wire.CLOSE_ENDED
        assert not tab.of("ended")

    run(test())
    assert "could not be closed" in caplog.text


def test_pings_are_answered_and_kept_once_a_second() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        round_.join(tab)
        for number in range(30):
            round_.match.ping(
                round_.person, wire.Ping(float(number), None), asyncio.get_running_loop().time()
            )
            await asyncio.sleep(0.1)
        assert len(tab.of("pong")) == 30
        assert [row.client_ms for row in round_.kept.clocks] == pytest.approx([0.0, 10.0, 20.0], abs=1.01)

    run(test())


def test_every_message_of_the_server_is_as_the_table_says() -> None:
    async def test() -> None:
        round_, tab, other = Round(horizon=20), Tab("one"), Tab("two")
        round_.join(tab)
        round_.ready()
        await until_tick(round_, 3)
        round_.key("right", True)
        await until_tick(round_, 9)
        round_.match.ping(round_.person, wire.Ping(1.0, 2.0), 5.0)
        round_.join(other)
        round_.ready()
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


def test_episodes_follow_each_other_with_a_countdown_and_count_as_one_round() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=5, episodes=3, seeds=(4, 5, 6)), Tab()
        round_.join(tab)
        round_.ready()
        while not round_.ends:
            await asyncio.sleep(0.1)
        await asyncio.sleep(1)
        assert [row.tick for row in round_.kept.ticks] == list(range(15))
        assert [m["tick"] for m in tab.of("tick")] == [1, 2, 3, 4, 5] * 3
        assert round_.mind.restarts == [(1, 5), (1, 6)]
        assert [tick for tick, _ in round_.mind.seen] == [0, 1, 2, 3, 4] * 3
        assert [seen for tick, seen in round_.mind.seen if tick == 0] == [None] * 3
        starts = [(m["phase"], m["episode"], m["tick"]) for m in tab.of("keyframe")]
        assert starts == [
            ("waiting", 1, 0),
            *[(phase, episode, 0) for episode in (1, 2, 3) for phase in ("countdown", "playing")],
        ]
        assert len(tab.of("countdown")) == 9
        gaps = np.diff([row.deadline_ms for row in round_.kept.ticks])
        assert np.allclose(np.delete(gaps, [4, 9]), 150.0)
        assert gaps[4] > 3000
        assert round_.ends == ["finished"]

    run(test())


def test_a_round_is_taken_up_in_the_episode_where_it_was() -> None:
    async def test() -> None:
        for played, episode, tick in ((7, 2, 2), (5, 2, 0), (14, 3, 4)):
            round_, tab = Round(horizon=5, episodes=3, played=[(STAY, STAY)] * played), Tab()
            round_.join(tab)
            frame = tab.messages[0]
            assert (frame["phase"], frame["episode"], frame["tick"]) == ("paused", episode, tick)
            round_.ready()
            while not round_.ends:
                await asyncio.sleep(0.1)
            await asyncio.sleep(1)
            assert [row.tick for row in round_.kept.ticks] == list(range(played, 15))

    run(test())


def test_the_last_state_of_a_round_left_between_episodes_is_of_the_one_that_was_played() -> None:
    layout = Layout.from_ascii("test", LAYOUT, horizon_ticks=3)
    course = caught_up(layout, 2, np.array([[EAST, STAY]] * 3, dtype=np.uint8))
    assert (course.episode, course.kitchen.tick) == (2, 0)
    alone = Kitchen(layout)
    for _ in range(3):
        alone.step(EAST, STAY)
    assert course.last_state.tolist() == alone.state.tolist()


def test_in_press_mode_every_press_is_one_action() -> None:
    async def test() -> None:
        round_ = Round(horizon=8, input_mode="press")
        round_.join(Tab())
        round_.ready()
        await until_tick(round_, 1)
        for name in ("right", "left", "up"):
            round_.key(name, True)
        await until_tick(round_, 8)
        await asyncio.sleep(1)
        taken = [row.action_0 for row in round_.kept.ticks]
        assert taken == [STAY, EAST, WEST, NORTH, STAY, STAY, STAY, STAY]

    run(test())


def test_a_page_out_of_sight_is_noted_until_it_is_seen_again() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=90), Tab()
        round_.join(tab)
        round_.release("hidden")
        assert not round_.away, "nothing is played yet"
        round_.ready()
        await until_tick(round_, 2)
        start = asyncio.get_running_loop().time()
        round_.release("hidden")
        round_.release("hidden")
        await asyncio.sleep(2)
        round_.release("shown")
        round_.release("hidden")
        await asyncio.sleep(1)
        round_.match.leave(tab)
        ms = [1000 * (start + after) for after in (0, 2, 2, 3)]
        assert [(s, pytest.approx(a), b) for s, a, b in round_.away] == [
            (0, ms[0], None),
            (0, ms[0], pytest.approx(ms[1])),
            (0, ms[2], None),
            (0, ms[2], pytest.approx(ms[3])),
        ]

    run(test())


def test_a_round_that_another_server_took_over_stops_at_its_next_tick() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        lease = Lease(7, "me", 1, 10.0)
        round_.match.journal.lease = lease
        round_.join(tab)
        round_.ready()
        await until_tick(round_, 4)
        lease.lose()
        await asyncio.sleep(5)
        assert round_.kitchen.tick == 4
        assert tab.messages[-1] == {"type": "elsewhere"}
        assert tab.closed == wire.CLOSE_REPLACED
        assert (round_.ends, round_.idle) == ([], [round_.match])

    run(test())


def test_a_round_that_was_taken_over_before_it_could_be_closed_is_not_said_to_have_ended() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=2, finish_fails=LeaseLost("gone")), Tab()
        round_.join(tab)
        round_.ready()
        await until_tick(round_, 2)
        await asyncio.sleep(1)
        assert not tab.of("ended")
        assert tab.closed == wire.CLOSE_REPLACED

    run(test())


# ---- two people ----------------------------------------------------------------------------------------


async def both_playing(round_: Round, ticks: int) -> tuple[Tab, Tab]:
    one, two = Tab("one"), Tab("two")
    round_.match.join(round_.person, one)
    round_.match.join(round_.other, two)
    round_.match.ready(round_.person)
    round_.match.ready(round_.other)
    await until_tick(round_, ticks)
    return one, two


def test_two_people_play_once_both_are_ready_and_each_key_moves_its_own_chef() -> None:
    async def test() -> None:
        round_ = Round(horizon=6, people=2, partner="human")
        one, two = Tab("one"), Tab("two")
        round_.match.join(round_.person, one)
        round_.match.ready(round_.person)
        with pytest.raises(wire.MessageError, match="other participant"):
            round_.match.ready(round_.person)
        await asyncio.sleep(20)
        assert round_.match.phase == "waiting"
        round_.match.join(round_.other, two)
        round_.match.ready(round_.other)
        await until_tick(round_, 1)
        round_.key("right", True)
        round_.key("up", True, round_.other)
        await until_tick(round_, 6)
        await asyncio.sleep(1)
        assert [(r.action_0, r.action_1) for r in round_.kept.ticks][1:] == [(EAST, NORTH)] * 5
        assert not any(row.late for row in round_.kept.ticks)
        assert [(row.key, row.seat) for row in round_.kept.keys] == [("right", 0), ("up", 1)]
        assert [(tab.messages[0]["seat"], tab.messages[0]["hats"]) for tab in (one, two)] == [
            (0, ["orange", "blue"]),
            (1, ["green", "red"]),
        ]
        assert one.of("tick") == two.of("tick")
        assert [tab.of("ended")[0]["next"] for tab in (one, two)] == ["/v/x", "/v/y"]

    run(test())


def test_a_pause_of_one_is_shown_to_both_and_only_who_left_presses_go_on() -> None:
    async def test() -> None:
        round_ = Round(people=2, partner="human")
        one, two = await both_playing(round_, 5)
        round_.match.leave(two)
        assert one.messages[-1] == {"type": "paused", "reason": "partner", "seconds_left": 60}
        await asyncio.sleep(10)
        back = Tab("two")
        round_.match.join(round_.other, back)
        assert back.messages[-1] == {"type": "paused", "reason": "left", "seconds_left": 50}
        with pytest.raises(wire.MessageError):
            round_.match.ready(round_.person)
        round_.match.ready(round_.other)
        await until_tick(round_, 20)
        await asyncio.sleep(1)
        assert [row.tick for row in round_.kept.ticks] == list(range(20))
        assert len(round_.kept.pauses) == 1
        assert round_.ends == ["finished"]

    run(test())


@pytest.mark.parametrize("leaver", [0, 1])
def test_a_drop_out_ends_the_round_for_the_other_who_is_told(leaver: int) -> None:
    async def test() -> None:
        round_ = Round(people=2, partner="human")
        tabs = await both_playing(round_, 5)
        round_.match.leave(tabs[leaver])
        await asyncio.sleep(61)
        assert round_.ends == ["abandoned"]
        assert tabs[1 - leaver].messages[-1]["outcome"] == "partner_left"
        late = Tab("late")
        round_.match.join((round_.person, round_.other)[leaver], late)
        assert late.messages[-1]["outcome"] == "abandoned"

    run(test())


def test_an_agent_takes_the_seat_of_a_drop_out_and_the_round_goes_on() -> None:
    async def test() -> None:
        round_ = Round(people=2, partner="human", dropout="myopic")
        one, two = await both_playing(round_, 5)
        round_.match.leave(two)
        await until_tick(round_, 20)
        await asyncio.sleep(1)
        assert round_.ends == ["finished"]
        assert [row.tick for row in round_.kept.ticks] == list(range(20))
        assert [row.action_1 for row in round_.kept.ticks] == [STAY] * 5 + [EAST] * 15
        assert one.messages[-1]["outcome"] == "finished"
        assert round_.match.people == [round_.person]

    run(test())


def test_when_both_are_gone_the_round_is_abandoned_whatever_the_study_says_of_drop_outs() -> None:
    async def test() -> None:
        round_ = Round(people=2, partner="human", dropout="myopic")
        one, two = await both_playing(round_, 5)
        round_.match.leave(two)
        round_.match.leave(one)
        await asyncio.sleep(130)
        assert round_.ends == ["abandoned"]

    run(test())


def test_who_never_presses_start_keeps_the_other_waiting_for_so_long_only() -> None:
    async def test() -> None:
        round_ = Round(people=2, partner="human")
        one, two = Tab("one"), Tab("two")
        round_.match.join(round_.person, one)
        round_.match.join(round_.other, two)
        round_.match.ready(round_.person)
        await asyncio.sleep(59)
        assert not round_.ends
        await asyncio.sleep(2)
        assert round_.ends == ["abandoned"]
        assert one.messages[-1]["outcome"] == "partner_left"
        assert two.messages[-1]["outcome"] == "abandoned"

    run(test())


def test_leaving_in_the_first_countdown_lets_both_press_start_again() -> None:
    async def test() -> None:
        round_ = Round(people=2, partner="human")
        one, two = await both_playing(round_, 0)
        assert round_.match.phase == "countdown"
        round_.match.leave(two)
        assert one.messages[-1]["phase"] == "waiting"
        round_.match.join(round_.other, two)
        round_.match.ready(round_.person)
        round_.match.ready(round_.other)
        await until_tick(round_, 20)

    run(test())
