"""Agents that may think longer than a tick: each in a thread of its own, so that it delays nobody else's."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from galley.agents.protocol import Agent
from galley.server.rounds.thinking import Mind, Question, Thinking, Unable

LOG = logging.getLogger(__name__)


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
