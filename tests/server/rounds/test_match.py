"""A round's phases and clock, on an event loop whose time is the test's."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

from galley.kitchen import EAST, INTERACT, NORTH, STAY, WEST
from galley.protocol import codec, field_kinds, messages
from galley.server.clock import Stagger, first_deadline
from galley.server.rounds.minds import Answer
from tests.server.rounds.live_round import TICK_S, Loop, Round, Tab, run, until_tick


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
        with pytest.raises(codec.MessageError, match="waiting"):
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
        with pytest.raises(codec.MessageError, match="ended"):
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
        assert old.closed == messages.CLOSE_REPLACED
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
        assert dead.closed == messages.CLOSE_REPLACED

    run(test())


def test_ready_out_of_turn_is_refused_and_changes_nothing() -> None:
    async def test() -> None:
        round_, tab = Round(horizon=5), Tab()
        round_.join(tab)
        round_.ready()
        with pytest.raises(codec.MessageError, match="countdown"):
            round_.ready()
        await until_tick(round_, 2)
        with pytest.raises(codec.MessageError, match="playing"):
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
        assert tab.closed == messages.CLOSE_ENDED
        assert not tab.of("ended")

    run(test())
    assert "could not be closed" in caplog.text


def test_pings_are_answered_and_kept_once_a_second() -> None:
    async def test() -> None:
        round_, tab = Round(), Tab()
        round_.join(tab)
        for number in range(30):
            round_.match.ping(
                round_.person, messages.Ping(float(number), None), asyncio.get_running_loop().time()
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
        round_.match.ping(round_.person, messages.Ping(1.0, 2.0), 5.0)
        round_.join(other)
        round_.ready()
        await until_tick(round_, 20)
        await asyncio.sleep(1)
        seen = set()
        for message in [*tab.messages, *other.messages]:
            row = messages.SERVER[message.pop("type")]
            seen.add(row.name)
            assert set(message) == {field.name for field in row.fields}
            for field in row.fields:
                assert field_kinds.holds(field.kind, message[field.name]), (
                    row.name,
                    field.name,
                    message[field.name],
                )
        assert seen == set(messages.SERVER) - {"refused"}

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
