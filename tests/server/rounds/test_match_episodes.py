"""Episodes, modes, absences and lost leases of a round, on an event loop whose time is the test's."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

from galley.kitchen import EAST, NORTH, STAY, WEST, Kitchen, Layout
from galley.protocol import messages
from galley.records import Lease, LeaseLost
from galley.records.store.absences import MOST_ABSENCES
from galley.server.rounds.round_kitchen import caught_up
from tests.server.rounds.live_round import LAYOUT, Round, Tab, run, until_tick


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
    round_kitchen = caught_up(layout, 2, np.array([[EAST, STAY]] * 3, dtype=np.uint8))
    assert (round_kitchen.episode, round_kitchen.kitchen.tick) == (2, 0)
    alone = Kitchen(layout)
    for _ in range(3):
        alone.step(EAST, STAY)
    assert round_kitchen.last_state.tolist() == alone.state.tolist()


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


def test_a_page_that_flickers_is_not_recorded_without_end() -> None:
    async def test() -> None:
        round_ = Round(horizon=9)
        round_.join(Tab())
        round_.ready()
        await until_tick(round_, 2)
        for _ in range(MOST_ABSENCES + 50):
            round_.release("hidden")
            round_.release("shown")
        assert len(round_.away) == 2 * MOST_ABSENCES

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
        assert tab.closed == messages.CLOSE_REPLACED
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
        assert tab.closed == messages.CLOSE_REPLACED

    run(test())
