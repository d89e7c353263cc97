"""Where agents observe and decide: in one thread, many rounds' agents in a batch; slow ones in their own."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from galley.agents.agent_batch import act_all
from galley.agents.protocol import Agent
from galley.kitchen import ACTIONS, STAY, Layout

T = TypeVar("T")
LOG = logging.getLogger(__name__)
FAULT_ERROR = "error"
FAULT_INVALID = "invalid"


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of a question: an action, or None with the fault; `decision_ms` from asking to answering."""

    action: int | None
    decision_ms: float
    fault: str | None


class LastDecision:
    """What an agent decided last in an episode; None before it decided anything."""

    __slots__ = ("action",)

    def __init__(self) -> None:
        self.action: int | None = None


class Question:
    """What one agent shall do at one tick; `answer` is there as soon as the thinking thread has set it."""

    __slots__ = ("answer", "asked_s", "last", "mind", "seen", "state", "tick")

    def __init__(
        self,
        mind: Mind,
        tick: int,
        state: NDArray[np.int16],
        seen: tuple[NDArray[np.int16], tuple[int, int]] | None,
    ) -> None:
        self.mind = mind
        self.tick = tick
        self.state = state
        self.seen = seen
        self.last = mind.last
        self.asked_s = time.monotonic()
        self.answer: Answer | None = None

    @property
    def late_action(self) -> int:
        """What is done when no answer is there: to stay, or what an agent that repeats decided last."""
        return STAY if self.last.action is None or not self.mind.repeats else self.last.action


class Mind:
    """One agent at work in one round. Only the thinking thread touches the agent itself.

    An agent that `repeats` does again what it decided last in the episode while it has not decided anew.
    """

    def __init__(self, thinking: Thinking, agent: Agent, name: str, *, repeats: bool = False) -> None:
        self._thinking = thinking
        self.agent: Agent = agent
        self.name = name
        self.repeats = repeats
        self.last = LastDecision()
        self.newest: Question | None = None
        self.told_fault = False

    def ask(
        self, tick: int, state: NDArray[np.int16], seen: tuple[NDArray[np.int16], tuple[int, int]] | None
    ) -> Question:
        """Ask for the action at `tick` in `state` (int16 [S], not changed afterwards); returns at once.

        `seen` is the state before and the joint action that led here, shown to the agent first; None at the
        start and when the agent has been shown it already. A question that is overtaken by the next is never
        answered.
        """
        question = Question(self, tick, state, seen)
        self.newest = question
        self._thinking.put(question)
        return question

    def restart(self, layout: Layout, seat: int, seed: int) -> None:
        """Let the agent begin the next episode, before what is asked from now on; returns at once."""

        def begin() -> None:
            try:
                self.agent.reset(layout, seat, seed)
            except Exception:  # whatever a researcher's agent raises, the round goes on
                LOG.exception("agent %s cannot begin again on layout %s", self.name, layout.name)
                self.agent = Unable()

        # What is still being decided was asked in the episode before, and is kept with it.
        self.last = LastDecision()
        self._thinking.do(begin)

    def stop(self) -> None:
        """The round is over or goes on elsewhere; the thread they share belongs to all."""


class Unable:
    """Stands in for an agent that could not be made ready: each decision is a fault, so it stays."""

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin nothing."""

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """Never an action.

        Raises:
            RuntimeError: always.
        """
        raise RuntimeError("the agent could not be made ready for this round")

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Note nothing."""


class Thinking:
    """Owns the thinking thread: `start` it, `mind` for each round's agent, `stop` it.

    Batches begin at least `window_s` apart: a question that comes alone is answered at once, and the more
    rounds there are the more of them share a batch.
    """

    def __init__(self, window_s: float = 0.01, name: str = "galley-thinking") -> None:
        self.busy_since_s: float | None = None
        self._window_s = window_s
        self._name = name
        self._leaving = False
        self._began_s = 0.0
        self._work: SimpleQueue[Question | Callable[[], None] | None] = SimpleQueue()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to think."""
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Finish what has been asked and end the thread."""
        if self._thread is not None:
            self._work.put(None)
            self._thread.join()
            self._thread = None

    def leave(self) -> None:
        """End the thread without waiting for it, and drop what it has not begun."""
        self._leaving = True
        self._work.put(None)

    def put(self, question: Question) -> None:
        """Queue a question."""
        self._work.put(question)

    def do(self, work: Callable[[], T]) -> Future[T]:
        """The result of `work`, done in the thinking thread in its turn."""
        done: Future[T] = Future()

        def job() -> None:
            if not done.set_running_or_notify_cancel():
                return
            try:
                done.set_result(work())
            except BaseException as error:  # handed to whoever waits for the result
                done.set_exception(error)

        self._work.put(job)
        return done

    # ---- the thinking thread -------------------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            batch = [self._work.get()]
            if isinstance(batch[0], Question):
                now_s = time.monotonic()
                if (wait_s := self._began_s + self._window_s - now_s) > 0:
                    time.sleep(wait_s)
                self._began_s = max(now_s, self._began_s + self._window_s)
            try:
                while True:
                    batch.append(self._work.get_nowait())
            except Empty:
                pass
            questions: list[Question] = []
            self.busy_since_s = time.monotonic()
            for work in batch:
                if self._leaving:
                    return
                if isinstance(work, Question):
                    self._show(work)
                    questions.append(work)
                elif work is not None:
                    work()
            self._decide([question for question in questions if question.mind.newest is question])
            self.busy_since_s = None
            if None in batch:
                return

    def _show(self, question: Question) -> None:
        if question.seen is None:
            return
        try:
            question.mind.agent.observe(*question.seen)
        except Exception:  # whatever a researcher's agent raises, the round goes on
            self._tell(question.mind, "raised while observing")

    def _decide(self, questions: list[Question]) -> None:
        if not questions:
            return
        try:
            actions: list[Any] = list(
                act_all(
                    [question.mind.agent for question in questions],
                    [question.state for question in questions],
                    [question.tick for question in questions],
                )
            )
        except Exception:  # one agent's fault must not cost the others their turn: ask each by itself
            for question in questions:
                self._decide_alone(question)
            return
        for question, action in zip(questions, actions, strict=True):
            self._answer(question, action)

    def _decide_alone(self, question: Question) -> None:
        try:
            action: Any = question.mind.agent.act(question.state, question.tick)
        except Exception:  # as in _decide
            self._tell(question.mind, "raised while deciding")
            self._answer(question, None, FAULT_ERROR)
            return
        self._answer(question, action)

    def _answer(self, question: Question, action: Any, fault: str | None = None) -> None:
        decision_ms = (time.monotonic() - question.asked_s) * 1000.0
        if fault is None and not (isinstance(action, (int, np.integer)) and 0 <= action < len(ACTIONS)):
            self._tell(question.mind, f"decided {action!r}, which is no action", trace=False)
            action, fault = None, FAULT_INVALID
        if action is not None:
            question.last.action = int(action)
        question.answer = Answer(None if action is None else int(action), decision_ms, fault)

    @staticmethod
    def _tell(mind: Mind, what: str, trace: bool = True) -> None:
        """Log an agent's first fault in a round; the records hold them all."""
        if not mind.told_fault:
            mind.told_fault = True
            LOG.error("agent %s %s; it stays where it is", mind.name, what, exc_info=trace)


class SlowMind(Mind):
    """A mind whose agent is made ready, shown and asked in its own thread, which nobody waits for.

    An answer that comes too late is as late as anybody's: it counts for no tick, unless the agent repeats its
    last decision. One that takes longer than its `think_ms` is told of once.
    """

    def __init__(
        self, make_ready: Callable[[], Agent], name: str, think_ms: int, *, repeats: bool = False
    ) -> None:
        own = Thinking(window_s=0.0, name=f"galley-thinking-{name}")
        super().__init__(own, Unable(), name, repeats=repeats)
        self._own = own
        self._think_s = think_ms / 1000.0
        self._told_slow = False

        def get_ready() -> None:
            self.agent = make_ready()

        own.do(get_ready)
        own.start()

    def ask(
        self, tick: int, state: NDArray[np.int16], seen: tuple[NDArray[np.int16], tuple[int, int]] | None
    ) -> Question:
        """Ask as any mind is asked; returns at once."""
        since_s = self._own.busy_since_s
        if since_s is not None and not self._told_slow and time.monotonic() - since_s > self._think_s:
            self._told_slow = True
            LOG.warning(
                "agent %s thinks longer than its think_ms of %.0f; the round goes on without it",
                self.name,
                1000.0 * self._think_s,
            )
        return super().ask(tick, state, seen)

    def stop(self) -> None:
        """Let the thread end as soon as the agent lets it; returns at once."""
        self._own.leave()
