"""An agent tried on a layout: what goes wrong, and how long its decisions take."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from galley.agents.bundle import Bundle
from galley.agents.protocol import Agent
from galley.errors import GalleyError, InvalidFiles, Problem
from galley.kitchen import ACTIONS, STAY, Kitchen, Layout

TRIAL_TICKS = 100
WARM_UP_TICKS = 5
SLOWEST_MS = 50.0
"""A third of a tick of 150 ms: the 99th percentile of decision times must stay below."""


@dataclass(frozen=True)
class Findings:
    """What an agent did beside itself; `faults` says what was wrong, each kind once.

    Decision times are those of both seats, ms, in processor time of the deciding thread, so what else the
    machine does is not held against the agent; NaN if nothing could be played.
    """

    layout: str
    faults: tuple[str, ...]
    score: int
    decision_p50_ms: float
    decision_p99_ms: float


@dataclass(frozen=True)
class Trial:
    """What was found; the decision time is the 99th percentile in ms, NaN if nothing could be played."""

    layout: str
    problems: tuple[Problem, ...]
    decision_p99_ms: float


def trial(bundle: Bundle, layout: Layout, ticks: int = TRIAL_TICKS) -> Trial:
    """How an agent plays beside itself: failures, illegal or inconstant actions, slowness."""
    try:
        found = findings(bundle, layout, ticks)
    except InvalidFiles as error:
        return Trial(layout.name, error.problems, float("nan"))
    place = ("layouts",) if bundle.layouts is None else ("layouts", layout.name)
    problems = tuple(
        bundle.loaded.problem(
            place, f"on layout '{layout.name}' {fault}", "mend or replace the agent, see docs/add-an-agent.md"
        )
        for fault in found.faults
    )
    return Trial(layout.name, problems, found.decision_p99_ms)


def findings(bundle: Bundle, layout: Layout, ticks: int) -> Findings:
    """What is found in `ticks` ticks (or to the end of the episode) of an agent beside itself, twice.

    An agent that fails in a tick stays, as in a round, and is asked again in the next.

    Raises:
        InvalidFiles: the bundle's network for this layout cannot be used.
    """
    try:
        first = _play(bundle, layout, ticks)
    except InvalidFiles:
        raise
    except GalleyError as error:
        return Findings(layout.name, (str(error),), 0, float("nan"), float("nan"))
    faults = dict.fromkeys(first.faults)
    if first.actions != _play(bundle, layout, ticks).actions:
        faults["with the same seed the agent acts in another way the second time"] = None
    slowest = float(np.percentile(first.times_ms, 99))
    if slowest > SLOWEST_MS:
        told = f"decisions are slow: 99th percentile {slowest:.1f} ms, more than {SLOWEST_MS:.0f} ms"
        faults[told] = None
    return Findings(layout.name, tuple(faults), first.score, float(np.median(first.times_ms)), slowest)


@dataclass(frozen=True)
class _Played:
    actions: list[Any]
    times_ms: list[float]
    faults: list[str]
    score: int


def _play(bundle: Bundle, layout: Layout, ticks: int) -> _Played:
    """The actions of both seats in turn, and the ms that each decision took."""
    kitchen = Kitchen(layout)
    pair = (bundle.make(), bundle.make())
    for seat, agent in enumerate(pair):
        agent.reset(layout, seat, seed=1)
    actions: list[Any] = []
    times_ms: list[float] = []
    faults: list[str] = []
    for tick in range(min(ticks, layout.rules.horizon_ticks)):
        if kitchen.done:
            break
        state = kitchen.state.copy()
        joint = []
        for agent in pair:
            start = time.thread_time()
            action, fault = _asked(agent, state, tick)
            if tick >= WARM_UP_TICKS:
                times_ms.append(1000 * (time.thread_time() - start))
            actions.append(action)
            if fault is not None:
                faults.append(fault)
            joint.append(STAY if fault is not None else action)
        kitchen.step(joint[0], joint[1])
        for agent in pair:
            fault = _shown(agent, state, (joint[0], joint[1]))
            if fault is not None:
                faults.append(fault)
    return _Played(actions, times_ms or [0.0], faults, kitchen.score)


def _asked(agent: Agent, state: NDArray[np.int16], tick: int) -> tuple[Any, str | None]:
    """The agent's answer, and what is wrong with it."""
    try:
        action = agent.act(state, tick)
    except GalleyError as error:
        return None, str(error)
    except Exception as error:  # whatever an agent raises, it is told and the trial goes on
        return None, f"deciding raises {type(error).__name__}: {error}"
    if action not in range(len(ACTIONS)):
        return action, f"{action!r} is no action"
    return action, None


def _shown(agent: Agent, state: NDArray[np.int16], joint: tuple[int, int]) -> str | None:
    """What went wrong while the agent observed."""
    try:
        agent.observe(state, joint)
    except GalleyError as error:
        return str(error)
    except Exception as error:  # as above
        return f"observing raises {type(error).__name__}: {error}"
    return None
