"""A round of two people, on an event loop whose time is the test's."""

from __future__ import annotations

import asyncio

import pytest

from galley.kitchen import EAST, NORTH, STAY
from galley.protocol import codec
from tests.server.rounds.live_round import Round, Tab, run, until_tick


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
        with pytest.raises(codec.MessageError, match="other participant"):
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
        with pytest.raises(codec.MessageError):
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
        round_ = Round(people=2, partner="human", stand_in="myopic")
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
        round_ = Round(people=2, partner="human", stand_in="myopic")
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
