"""Agents at work in rounds: what they are asked, what came of it, and who stands in for one that cannot."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from galley.agents.bundle import Bundle
from galley.agents.episode import take_up
from galley.agents.protocol import Agent
from galley.kitchen import STAY, Layout

if TYPE_CHECKING:
    from galley.server.rounds.thinking import Thinking

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


class SlowMind(Mind):
    """A mind whose agent is made ready, shown and asked in its own thread, which nobody waits for.

    An answer that comes too late is as late as anybody's: it counts for no tick, unless the agent repeats its
    last decision. One that takes longer than its `think_ms` is told of once.
    """

    def __init__(
        self,
        own: Thinking,
        make_ready: Callable[[], Agent],
        name: str,
        think_ms: int,
        *,
        repeats: bool = False,
    ) -> None:
        super().__init__(own, Unable(), name, repeats=repeats)
        self._own = own
        self._think_s = think_ms / 1000.0
        self._told_slow = False

        def get_ready() -> None:
            self.agent = make_ready()

        own.do(get_ready)

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


def ready_agent(bundle: Bundle, layout: Layout, seat: int, seed: int, seen: NDArray[np.uint8]) -> Agent:
    """An agent of the bundle that has seen an episode so far (uint8 [T, 2]), as if it had always played it.

    One that fails at that is replaced by one that stays where it is.
    """
    try:
        agent: Agent = bundle.make()
        take_up(agent, layout, seat, seed, seen)
    except Exception:  # whatever a researcher's agent raises, the round goes on
        LOG.exception("agent %s cannot take up a round on layout %s", bundle.name, layout.name)
        return Unable()
    return agent
