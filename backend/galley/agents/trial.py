"""An agent tried on a layout: what goes wrong, and how long its decisions take."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from galley.agents.bundle import Bundle
from galley.agents.together import act_together
from galley.errors import GalleyError, InvalidFiles, Problem
from galley.kitchen import ACTIONS, Kitchen, Layout

TRIAL_TICKS = 100
WARM_UP_TICKS = 5
SLOWEST_MS = 50.0
"""A third of a tick of 150 ms: the 99th percentile of decision times must stay below."""


@dataclass(frozen=True)
class Trial:
    """What was found; the decision time is the 99th percentile in ms, NaN if nothing could be played.

    It is processor time of the deciding thread, so what else the machine does is not held against the agent.
    """

    layout: str
    problems: tuple[Problem, ...]
    decision_p99_ms: float


def trial(bundle: Bundle, layout: Layout, ticks: int = TRIAL_TICKS) -> Trial:
    """How an agent plays beside itself: failures, illegal or inconstant actions, slowness."""
    try:
        first, times = _played(bundle, layout, ticks)
        again, _ = _played(bundle, layout, ticks)
    except InvalidFiles as error:
        return Trial(layout.name, error.problems, float("nan"))
    except GalleyError as error:
        return Trial(layout.name, (_problem(bundle, layout, str(error)),), float("nan"))
    problems = []
    wrong = [action for action in first if action not in range(len(ACTIONS))]
    if wrong:
        problems.append(_problem(bundle, layout, f"{wrong[0]!r} is no action"))
    if first != again:
        told = "with the same seed the agent acts in another way the second time"
        problems.append(_problem(bundle, layout, told))
    slowest = float(np.percentile(times, 99))
    if slowest > SLOWEST_MS:
        told = f"decisions are slow: 99th percentile {slowest:.1f} ms, more than {SLOWEST_MS:.0f} ms"
        problems.append(_problem(bundle, layout, told))
    return Trial(layout.name, tuple(problems), slowest)


def _played(bundle: Bundle, layout: Layout, ticks: int) -> tuple[list[int], list[float]]:
    """The actions of both seats in turn, and the ms that each decision of one agent took."""
    kitchen = Kitchen(layout)
    pair = (bundle.make(), bundle.make())
    for seat, agent in enumerate(pair):
        agent.reset(layout, seat, seed=1)
    actions: list[int] = []
    times: list[float] = []
    for tick in range(ticks):
        if kitchen.done:
            break
        state = kitchen.state.copy()
        start = time.thread_time()
        own = act_together([pair[0]], [state], [tick])[0]
        if tick >= WARM_UP_TICKS:
            times.append(1000 * (time.thread_time() - start))
        joint = (own, act_together([pair[1]], [state], [tick])[0])
        actions += joint
        if not all(action in range(len(ACTIONS)) for action in joint):
            break
        kitchen.step(*joint)
        for agent in pair:
            agent.observe(state, joint)
    return actions, times or [0.0]


def _problem(bundle: Bundle, layout: Layout, message: str) -> Problem:
    place = ("layouts",) if bundle.layouts is None else ("layouts", layout.name)
    told = f"on layout '{layout.name}' {message}"
    return bundle.loaded.problem(place, told, "mend or replace the agent, see docs/add-an-agent.md")
