"""Where agents observe and decide: in a thread for each agent of the workspace, many rounds in a batch.

A thread that takes too long is interrupted, and one that does not let itself be interrupted is left behind:
what it was asked counts as a fault, and another takes its place.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any, Final, TypeVar
from weakref import WeakSet

import numpy as np

from galley.agents.agent_batch import act_all
from galley.agents.bundle import Bundle
from galley.agents.protocol import Agent
from galley.kitchen import ACTIONS
from galley.server.rounds.minds import FAULT_ERROR, FAULT_INVALID, Answer, Mind, Question, SlowMind, Unable

T = TypeVar("T")
LOG = logging.getLogger(__name__)
DECIDE_WITHIN_S: Final = 5.0
"""How long a batch of decisions may take before it is interrupted; each is late for its tick long before."""
ALONE_WITHIN_S: Final = 1.0
"""The same for each agent by itself, when a batch had to be interrupted."""
READY_WITHIN_S: Final = 30.0
"""How long an agent may take to be made ready for a round."""
STOPS_WITHIN_S: Final = 1.0
"""How soon what was interrupted has to stop."""
MOST_LEFT_BEHIND: Final = 3
"""After so many stuck threads an agent is asked nothing more: each may keep a core busy for good."""
WATCH_EVERY_S: Final = 0.25


Work = Question | Callable[[], None] | None
"""What a thread does: answer a question, do a job, or end."""


class Thinking:
    """Owns a thinking thread: `start` it, minds `put` their questions, `stop` it; `tend` it now and then.

    Batches begin at least `window_s` apart: a question that comes alone is answered at once, and the more
    rounds there are the more of them share a batch. `interrupt` makes what an agent does just now fail.
    """

    def __init__(
        self,
        window_s: float = 0.01,
        name: str = "galley-thinking",
        *,
        interrupt: Callable[[], None] = lambda: None,
        decide_within_s: float = DECIDE_WITHIN_S,
    ) -> None:
        self.busy_since_s: float | None = None
        self.name = name
        self.given_up = 0
        """How often an agent was given up for its round."""
        self._window_s = window_s
        self._interrupt = interrupt
        self._decide_within_s = self._within_s = decide_within_s
        self._interrupted = False
        self._leaving = False
        self._began_s = 0.0
        self._left_behind = 0
        self._work: SimpleQueue[Work] = SimpleQueue()
        self._batch: deque[Work] = deque()
        self._asked: list[Question] = []
        self._doing: Future[Any] | None = None
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to think."""
        self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
        self._thread.start()

    def stop(self, within_s: float | None = None) -> bool:
        """Finish what has been asked and end the thread; whether it ended in time."""
        thread = self._thread
        if thread is not None:
            self._work.put(None)
            thread.join(within_s)
            if thread.is_alive():
                self._leaving = True
                self._interrupt()
                thread.join(STOPS_WITHIN_S)
            self._thread = None
        return thread is None or not thread.is_alive()

    def leave(self) -> None:
        """End the thread without waiting for it, and drop what it has not begun."""
        self._leaving = True
        self._work.put(None)
        if self.stuck:
            self._interrupt()

    def put(self, question: Question) -> None:
        """Queue a question."""
        if self._left_behind >= MOST_LEFT_BEHIND:
            question.answer = Answer(None, 0.0, FAULT_ERROR)
        else:
            self._work.put(question)

    def do(self, work: Callable[[], T]) -> Future[T]:
        """The result of `work`, done in the thinking thread in its turn.

        It raises TimeoutError when it took too long and did not let itself be interrupted.
        """
        done: Future[T] = Future()
        if self._left_behind >= MOST_LEFT_BEHIND:
            done.set_exception(TimeoutError(f"{self.name} was stuck {self._left_behind} times"))
            return done

        def job() -> None:
            if not done.set_running_or_notify_cancel():
                return
            self._begin(READY_WITHIN_S)
            self._doing = done
            try:
                found = work()
            except BaseException as error:  # handed to whoever waits for the result
                with suppress(InvalidStateError):
                    done.set_exception(error)
            else:
                with suppress(InvalidStateError):
                    done.set_result(found)
            self._doing = None

        self._work.put(job)
        return done

    # ---- who looks after it --------------------------------------------------------------------------------

    @property
    def taken(self) -> float:
        """How much of the time that the thing it is at may take is over: above 1 it is stuck."""
        since_s = self.busy_since_s
        return 0.0 if since_s is None else (time.monotonic() - since_s) / self._within_s

    @property
    def stuck(self) -> bool:
        """Whether it has been at one thing for longer than that may take."""
        return self.taken > 1.0

    def tend(self) -> None:
        """Interrupt what takes too long; begin another thread for one that stays stuck, or died."""
        thread = self._thread
        if thread is None or self._leaving:
            return
        if not thread.is_alive():
            LOG.critical("%s died; another takes its place", self.name)
        elif not self.stuck:
            return
        elif not self._interrupted:
            self._interrupted = True
            LOG.error("%s is at one thing for over %.0f s: it is interrupted", self.name, self._within_s)
            self._interrupt()
            return
        elif time.monotonic() - (self.busy_since_s or 0.0) < self._within_s + STOPS_WITHIN_S:
            return
        else:
            LOG.error("%s cannot be interrupted: it is left behind, and its rounds with it", self.name)
            self._left_behind += 1
        self._thread = None  # what still runs sees that it is no longer the one
        for question in self._asked:
            self._give_up(question)
        if self._doing is not None:
            with suppress(InvalidStateError):
                self._doing.set_exception(TimeoutError(f"{self.name} is stuck"))
        self._asked, self._doing, self.busy_since_s = [], None, None
        self.start()

    def _give_up(self, question: Question) -> None:
        """Ask the question's agent nothing more in its round."""
        self.given_up += 1
        question.mind.agent = Unable()
        question.answer = Answer(None, (time.monotonic() - question.asked_s) * 1000.0, FAULT_ERROR)

    # ---- the thinking thread -------------------------------------------------------------------------------

    def _begin(self, within_s: float) -> None:
        self._within_s = within_s
        self._interrupted = False
        self.busy_since_s = time.monotonic()

    def _run(self) -> None:
        me = threading.current_thread()
        while True:
            if not self._batch:
                self._gather()
            questions: list[Question] = []
            last = False
            while self._batch:
                work = self._batch.popleft()
                if self._leaving:
                    return
                if work is None:
                    last = True
                elif isinstance(work, Question):
                    self._begin(self._decide_within_s)
                    self._show(work)
                    questions.append(work)
                else:
                    work()
                if self._thread is not me:
                    return
            try:
                self._decide([question for question in questions if question.mind.newest is question])
            except Exception:  # a fault of ours must not end the thread, and with it all its rounds
                LOG.exception("%s failed; it goes on", self.name)
            if self._thread is not me:
                return
            self._asked, self.busy_since_s = [], None
            if last:
                return

    def _gather(self) -> None:
        """Wait for work and take all that there is."""
        first = self._work.get()
        if isinstance(first, Question):
            now_s = time.monotonic()
            if (wait_s := self._began_s + self._window_s - now_s) > 0:
                time.sleep(wait_s)
            self._began_s = max(now_s, self._began_s + self._window_s)
        self._batch.append(first)
        try:
            while True:
                self._batch.append(self._work.get_nowait())
        except Empty:
            pass

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
        self._begin(self._decide_within_s)
        self._asked = questions
        try:
            actions: list[Any] = list(
                act_all(
                    [question.mind.agent for question in questions],
                    [question.state for question in questions],
                    [question.tick for question in questions],
                )
            )
        except Exception:  # one agent's fault must not cost the others their turn: ask each by itself
            within_s = ALONE_WITHIN_S if self._interrupted else self._decide_within_s
            for question in questions:
                self._decide_alone(question, within_s)
            return
        for question, action in zip(questions, actions, strict=True):
            self._answer(question, action)

    def _decide_alone(self, question: Question, within_s: float) -> None:
        self._begin(within_s)
        self._asked = [question]
        try:
            action: Any = question.mind.agent.act(question.state, question.tick)
        except Exception:  # as in _decide
            if self._interrupted:
                self._tell(question.mind, "did not answer and is given up for this round", trace=False)
                self._give_up(question)
            else:
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


class ThinkingThreads:
    """A thinking thread for each agent of the workspace, begun when it is first met, and one for kitchens.

    So none holds up another's rounds, whatever it does. `watch` has to run beside them.
    """

    def __init__(self, window_s: float = 0.01) -> None:
        self.kitchens = Thinking(window_s)
        self._window_s = window_s
        self._of: dict[str, Thinking] = {}
        self._own: WeakSet[Thinking] = WeakSet()

    def start(self) -> None:
        """Begin to think."""
        self.kitchens.start()

    async def mind(self, bundle: Bundle, ready: Callable[[], Agent]) -> Mind:
        """A mind for a round, whose agent `ready` makes ready: in the thread that all rounds with it share.

        One that declares how long it may take gets a thread of its own, and nobody waits for it.
        """
        if bundle.think_ms is not None:
            within_s = bundle.think_ms / 1000.0 + DECIDE_WITHIN_S
            own = self._begun(bundle, window_s=0.0, decide_within_s=within_s)
            self._own.add(own)
            return SlowMind(own, ready, bundle.name, bundle.think_ms, repeats=bundle.repeats)
        if bundle.name not in self._of:
            self._of[bundle.name] = self._begun(bundle, self._window_s, DECIDE_WITHIN_S)
        thinking = self._of[bundle.name]
        try:
            agent = await asyncio.wrap_future(thinking.do(ready))
        except TimeoutError as error:
            LOG.error("agent %s cannot be made ready: %s", bundle.name, error)
            agent = Unable()
        return Mind(thinking, agent, bundle.name, repeats=bundle.repeats)

    @staticmethod
    def _begun(bundle: Bundle, window_s: float, decide_within_s: float) -> Thinking:
        name = f"galley-thinking-{bundle.name}"
        begun = Thinking(window_s, name, interrupt=bundle.interrupt, decide_within_s=decide_within_s)
        begun.start()
        return begun

    async def watch(self) -> None:
        """Tend all threads, for good."""
        while True:
            await asyncio.sleep(WATCH_EVERY_S)
            for thinking in self._all():
                thinking.tend()

    def stuck(self) -> list[str]:
        """The names of threads that are stuck just now, or have used up half of their time."""
        return sorted({thinking.name for thinking in self._all() if thinking.taken > 0.5})

    def given_up(self) -> dict[str, int]:
        """How often each agent was given up for a round, those that were."""
        return {name: thinking.given_up for name, thinking in sorted(self._of.items()) if thinking.given_up}

    def stop(self) -> bool:
        """End all threads; whether all ended, and none was stuck."""
        for thinking in self._all():
            if thinking.stuck:
                thinking.leave()
        ended = [thinking.stop(STOPS_WITHIN_S) for thinking in self._all()]
        return all(ended)

    def _all(self) -> Iterator[Thinking]:
        yield self.kitchens
        yield from tuple(self._of.values())
        yield from tuple(self._own)
