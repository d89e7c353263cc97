"""The thinking thread: batches, faults, questions that are overtaken."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from galley.kitchen import EAST, STAY, WEST, Layout
from galley.server.rounds.minds import Mind, Question
from galley.server.rounds.thinking import Thinking
from tests.server.helpers import wait_until

STATE = np.zeros(9, dtype=np.int16)


class Scripted:
    """An agent that notes what it is shown and decides by a function of the tick."""

    def __init__(self, decide: Callable[[int], Any] = lambda tick: EAST) -> None:
        self.decide = decide
        self.seen: list[tuple[int, int]] = []
        self.asked: list[int] = []

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        pass

    def act(self, state: NDArray[np.int16], tick: int) -> Any:
        self.asked.append(tick)
        return self.decide(tick)

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        self.seen.append(joint_action)


class Clumsy(Scripted):
    """An agent that cannot even watch."""

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        raise ValueError("what?")


@pytest.fixture
def thinking() -> Iterator[Thinking]:
    found = Thinking(window_s=0.0)
    found.start()
    yield found
    found.stop()


def answered(*questions: Question) -> None:
    wait_until(lambda: all(question.answer is not None for question in questions))


def test_a_question_is_answered_with_an_action_and_how_long_it_took(thinking: Thinking) -> None:
    question = Mind(thinking, Scripted(), "one").ask(0, STATE, None)
    answered(question)
    assert question.answer is not None
    assert (question.answer.action, question.answer.fault) == (EAST, None)
    assert type(question.answer.action) is int
    assert question.answer.decision_ms >= 0


def test_an_agent_is_shown_what_happened_before_it_is_asked(thinking: Thinking) -> None:
    agent = Scripted()
    mind = Mind(thinking, agent, "one")
    answered(mind.ask(0, STATE, None))
    answered(mind.ask(1, STATE, (STATE, (WEST, EAST))))
    assert (agent.seen, agent.asked) == ([(WEST, EAST)], [0, 1])


def test_a_question_that_is_overtaken_is_skipped_but_its_news_are_not(thinking: Thinking) -> None:
    agent, gate = Scripted(), threading.Event()
    mind = Mind(thinking, agent, "one")
    busy = thinking.do(lambda: gate.wait(10))
    old = mind.ask(1, STATE, (STATE, (STAY, STAY)))
    new = mind.ask(2, STATE, (STATE, (EAST, WEST)))
    gate.set()
    answered(new)
    assert busy.result()
    assert old.answer is None
    assert (agent.seen, agent.asked) == ([(STAY, STAY), (EAST, WEST)], [2])


class Time:
    """A clock that stands at `now`; who sleeps waits until the test lets go."""

    def __init__(self) -> None:
        self.now = 100.0
        self.slept: list[float] = []
        self.go_on = threading.Event()

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        assert self.go_on.wait(10)


def test_who_asks_alone_is_answered_at_once_and_who_asks_next_shares_the_following_batch(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    time = Time()
    monkeypatch.setattr("galley.server.rounds.thinking.time", time)
    batches: list[int] = []

    class Counting(Thinking):
        def _decide(self, questions: list[Question]) -> None:
            batches.append(len(questions))
            super()._decide(questions)

    thinking = Counting(window_s=0.25)
    thinking.start()
    try:
        first = Mind(thinking, Scripted(), "first").ask(0, STATE, None)
        answered(first)
        assert (batches, time.slept) == ([1], [])
        time.now += 0.0625
        second = Mind(thinking, Scripted(), "second").ask(0, STATE, None)
        wait_until(lambda: time.slept == [0.1875])
        others = [Mind(thinking, Scripted(), f"{number}").ask(0, STATE, None) for number in range(4)]
        time.go_on.set()
        answered(second, *others)
        assert batches == [1, 5]
        time.now += 1.0
        answered(Mind(thinking, Scripted(), "late").ask(0, STATE, None))
        assert (batches, time.slept) == ([1, 5, 1], [0.1875])
    finally:
        thinking.stop()


def test_one_agent_at_fault_costs_the_others_nothing(
    thinking: Thinking, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(tick: int) -> int:
        raise ZeroDivisionError("mine alone")

    gate = threading.Event()
    thinking.do(lambda: gate.wait(10))
    good = [Mind(thinking, Scripted(), f"good {n}").ask(0, STATE, None) for n in range(3)]
    bad = Mind(thinking, Scripted(fail), "bad").ask(0, STATE, None)
    gate.set()
    answered(*good, bad)
    assert [question.answer.action for question in good if question.answer] == [EAST] * 3
    assert bad.answer is not None
    assert (bad.answer.action, bad.answer.fault) == (None, "error")
    assert "agent bad raised" in caplog.text


@pytest.mark.parametrize("nonsense", [6, -1, 2.0, float("nan"), None, "east", np.float32(1), np.array([1])])
def test_what_is_no_action_is_a_fault(thinking: Thinking, nonsense: Any) -> None:
    question = Mind(thinking, Scripted(lambda tick: nonsense), "odd").ask(0, STATE, None)
    answered(question)
    assert question.answer is not None
    assert (question.answer.action, question.answer.fault) == (None, "invalid")


def test_numpy_integers_are_actions(thinking: Thinking) -> None:
    question = Mind(thinking, Scripted(lambda tick: np.int64(WEST)), "one").ask(0, STATE, None)
    answered(question)
    assert question.answer is not None
    assert question.answer.action == WEST


def test_an_agent_that_cannot_watch_still_decides_and_is_told_of_once(
    thinking: Thinking, caplog: pytest.LogCaptureFixture
) -> None:
    mind = Mind(thinking, Clumsy(), "clumsy")
    for tick in range(3):
        question = mind.ask(tick, STATE, (STATE, (STAY, STAY)))
        answered(question)
        assert question.answer is not None
        assert question.answer.action == EAST
    assert caplog.text.count("agent clumsy raised while observing") == 1


def test_work_is_done_in_turn_and_its_error_reaches_who_waits(thinking: Thinking) -> None:
    assert thinking.do(lambda: threading.current_thread().name).result() == "galley-thinking"
    with pytest.raises(KeyError):
        thinking.do(lambda: {}["nothing"]).result()


def test_what_was_asked_before_the_stop_is_answered() -> None:
    thinking = Thinking()
    thinking.start()
    questions = [Mind(thinking, Scripted(), "one").ask(0, STATE, None) for _ in range(20)]
    thinking.stop()
    assert all(question.answer is not None for question in questions)
    thinking.stop()
