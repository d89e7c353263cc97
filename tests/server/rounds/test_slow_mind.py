"""Agents that take longer than a tick: their own round goes on, and nobody else's waits for them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from galley.kitchen import EAST, NORTH, STAY, WEST, Layout
from galley.server.rounds.minds import Mind, Question, SlowMind
from galley.server.rounds.thinking import Thinking
from tests.server.helpers import wait_until
from tests.server.rounds.test_thinking import Scripted, answered

STATE = np.zeros(9, dtype=np.int16)
LAYOUT = Layout.from_ascii("tiny", "XPX\nO1S\nX2D\nXXX")
SLEEP_S = 0.4


class Sleeping(Scripted):
    """An agent that takes its time."""

    def act(self, state: NDArray[np.int16], tick: int) -> Any:
        time.sleep(SLEEP_S)
        return super().act(state, tick)


class Stuck(Scripted):
    """An agent that never answers, until the test is over."""

    def __init__(self) -> None:
        super().__init__()
        self.test_is_over = threading.Event()

    def act(self, state: NDArray[np.int16], tick: int) -> Any:
        self.test_is_over.wait(60)
        return EAST


@pytest.fixture
def stuck() -> Iterator[Stuck]:
    agent = Stuck()
    yield agent
    agent.test_is_over.set()


def slow_mind(make: Callable[[], Any], name: str, think_ms: int, *, repeats: bool = False) -> SlowMind:
    own = Thinking(window_s=0.0, name=f"galley-thinking-{name}")
    own.start()
    return SlowMind(own, make, name, think_ms, repeats=repeats)


def action(question: Question) -> int:
    """What a round does at the deadline."""
    if question.answer is None or question.answer.action is None:
        return question.late_action
    return question.answer.action


def test_others_decide_at_once_beside_a_slow_and_a_stuck_agent(stuck: Stuck) -> None:
    thinking = Thinking(window_s=0.0)
    thinking.start()
    minds = [slow_mind(lambda: Sleeping(), "slow", 1000), slow_mind(lambda: stuck, "stuck", 1000)]
    try:
        late = [mind.ask(0, STATE, None) for mind in minds]
        for tick in range(20):
            question = Mind(thinking, Scripted(), "quick").ask(tick, STATE, None)
            answered(question)
            assert question.answer is not None
            assert question.answer.decision_ms < 1000 * SLEEP_S
        wait_until(lambda: late[0].answer is not None)
        assert late[0].answer is not None
        assert late[0].answer.action == EAST
        assert late[1].answer is None
    finally:
        for mind in minds:
            mind.stop()
        thinking.stop()


def test_a_late_answer_counts_for_no_tick_unless_the_agent_repeats() -> None:
    for repeats, wanted in ((False, STAY), (True, NORTH)):
        agent = Sleeping(lambda tick: NORTH if tick == 0 else WEST)
        mind = slow_mind(lambda agent=agent: agent, "slow", 1000, repeats=repeats)  # type: ignore[misc]
        first = mind.ask(0, STATE, None)
        second = mind.ask(1, STATE, (STATE, (STAY, STAY))) if not repeats else None
        assert action(first) == STAY, "nothing is decided yet"
        wait_until(lambda first=first, second=second: (second or first).answer is not None)
        later = mind.ask(2, STATE, (STATE, (STAY, STAY)))
        assert later.answer is None
        assert action(later) == wanted
        mind.stop()


def test_what_was_decided_in_an_episode_is_not_repeated_in_the_next() -> None:
    mind = slow_mind(lambda: Sleeping(lambda tick: NORTH), "slow", 1000, repeats=True)
    old = mind.ask(0, STATE, None)
    mind.restart(LAYOUT, 0, 1)
    new = mind.ask(0, STATE, None)
    assert action(new) == STAY
    wait_until(lambda: new.answer is not None)
    assert old.answer is None or old.last is not new.last
    assert action(mind.ask(1, STATE, None)) == NORTH
    mind.stop()


def test_a_stuck_agent_is_told_of_once_and_holds_nothing_up(
    stuck: Stuck, caplog: pytest.LogCaptureFixture
) -> None:
    mind = slow_mind(lambda: stuck, "stuck", think_ms=20, repeats=True)
    asked = [mind.ask(0, STATE, None)]
    for tick in range(1, 8):
        time.sleep(0.02)
        asked.append(mind.ask(tick, STATE, (STATE, (STAY, STAY))))
    assert [action(question) for question in asked] == [STAY] * 8
    assert caplog.text.count("agent stuck thinks longer than its think_ms of 20") == 1
    start = time.monotonic()
    mind.stop()
    assert time.monotonic() - start < 1.0


def test_what_nobody_waits_for_any_more_is_dropped(stuck: Stuck) -> None:
    mind = slow_mind(lambda: stuck, "stuck", 1000)
    mind.ask(0, STATE, None)
    for tick in range(1, 5):
        mind.ask(tick, STATE, (STATE, (EAST, STAY)))
    mind.stop()
    stuck.test_is_over.set()
    wait_until(lambda: not any(one.name == "galley-thinking-stuck" for one in threading.enumerate()))
    assert stuck.seen == []
