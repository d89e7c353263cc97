"""What every agent promises, put to the test: agents that are let in, and those that others write.

In a test of your own: `assert check(MyAgent, layout).faults == ()`; what is wrong says how to mend it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from galley.agents.episode import play_episode, take_up
from galley.agents.protocol import Agent
from galley.errors import GalleyError, InvalidFiles
from galley.kitchen import ACTIONS, STAY, Layout
from galley.kitchen.trajectory import play

CHECKED_TICKS: Final = 100
WARM_UP_TICKS: Final = 5
LATE_EVERY_TICKS: Final = 7
SEED: Final = 1
SLOWEST_MS: Final = 50.0
"""A third of a tick of 150 ms: the 99th percentile of decision times must stay below."""

SLOW_TICKS: Final = 20
"""So many of an agent that declares how long it may take: each may take that long."""

_MOVES: Final = f"0 to {len(ACTIONS) - 1} ({', '.join(ACTIONS)})"


@dataclass(frozen=True)
class Fault:
    """A promise that was broken, and how to mend it."""

    what: str
    fix: str

    def __str__(self) -> str:
        return f"{self.what}; {self.fix}"


@dataclass(frozen=True)
class Conduct:
    """What an agent did beside itself; `faults` says what was wrong, each kind once.

    Decision times are those of both seats, ms, in processor time of the deciding thread, so what else the
    machine does is not held against the agent (wall time for one that declares how long it may take); NaN if
    nothing could be played.
    """

    layout: str
    faults: tuple[Fault, ...]
    score: int
    decision_p50_ms: float
    decision_p99_ms: float


def check(
    make: Callable[[], Agent], layout: Layout, ticks: int = CHECKED_TICKS, think_ms: int | None = None
) -> Conduct:
    """How agents fresh from `make` play beside themselves for `ticks` ticks, or to the end of the episode.

    They must answer every state with an action, in time; act the same when reset with the same seed, whatever
    came before, and however often they are asked; and act the same when they were only shown what was done.
    An agent that fails in a tick stays, as in a round, and is asked again in the next. One that declares how
    long it may take (`think_ms`) is tried for SLOW_TICKS at most, and its times are those of the wall clock:
    what it waits for counts as well.

    Raises:
        InvalidFiles: a file that the agent needs cannot be used.
    """
    nan = float("nan")
    faults: list[Fault] = []
    clock = time.thread_time if think_ms is None else time.monotonic
    if think_ms is not None:
        ticks = min(ticks, SLOW_TICKS)
    first, again = (tuple(_Watched(make(), faults, clock) for _ in range(2)) for _ in range(2))
    try:
        played = play_episode(layout, (first[0], first[1]), SEED, ticks)
        play_episode(layout, (again[0], again[1]), SEED, ticks)
    except InvalidFiles:
        raise
    except GalleyError as error:
        return Conduct(layout.name, (Fault(str(error), "name only layouts that it knows"),), 0, nan, nan)
    if [one.answers for one in first] != [one.answers for one in again]:
        faults.append(
            Fault(
                "with the same seed the agent acts in another way the second time",
                "draw with galley.compiled.randomness.uniform(seed, seat, tick), from no clock or generator",
            )
        )
    times_ms = [spent for one in first for spent in one.times_ms] or [0.0]
    slowest = float(np.percentile(times_ms, 99))
    most_ms = SLOWEST_MS if think_ms is None else think_ms
    if slowest > most_ms:
        what = f"decisions are slow: 99th percentile {slowest:.1f} ms, more than {most_ms:.0f} ms"
        fix = "work out in `reset` what can be known before, or plan less far"
        faults.append(Fault(what, fix if think_ms is None else "declare a longer think_ms in agent.yaml"))
    if not faults:
        faults += _seen_only(make, again[0].agent, layout, ticks)
    score = play(layout, played.joint_actions).score
    told = tuple(dict.fromkeys(faults))
    return Conduct(layout.name, told, score, float(np.median(times_ms)), slowest)


def _seen_only(make: Callable[[], Agent], used: Agent, layout: Layout, ticks: int) -> list[Fault]:
    """What is wrong with agents that are shown an episode and asked from the middle on.

    One is fresh; the other, `used`, played an episode on the other seat before it is reset.
    """
    faults: list[Fault] = []
    other, asked = _Late(make()), _Watched(make(), faults)
    episode = play_episode(layout, (other, asked), SEED, ticks)
    states = play(layout, episode.joint_actions).states
    middle = len(episode.joint_actions) // 2
    for agent, what, fix in (
        (
            make(),
            "an agent that takes over, having only been shown what was done, acts in another way",
            "remember in `observe` what both chefs did (a late answer was not done), and nothing in `act`",
        ),
        (
            used,
            "reset after another episode, the agent acts in another way than a fresh one",
            "forget everything in `reset`",
        ),
    ):
        shown = _Watched(agent, faults)
        take_up(shown, layout, 1, SEED, episode.joint_actions[:middle])
        for tick, (first, second) in enumerate(episode.joint_actions.tolist()):
            if tick >= middle:
                shown.act(states[tick], tick)
                shown.act(states[tick], tick)
                shown.observe(states[tick], (first, second))
        if shown.answers[::2] != asked.answers[middle:]:
            faults.append(Fault(what, fix))
        if shown.answers[::2] != shown.answers[1::2]:
            what = "asked twice in one tick, the agent answers in two ways"
            faults.append(Fault(what, "change nothing in `act`"))
    return faults


class _Watched:
    """An agent whose `answers`, `times_ms` and `faults` are noted, and which stays when it fails."""

    def __init__(
        self, agent: Agent, faults: list[Fault], clock: Callable[[], float] = time.thread_time
    ) -> None:
        self._clock = clock
        self.agent = agent
        self.faults = faults
        self.answers: list[Any] = []
        self.times_ms: list[float] = []

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode."""
        self.agent.reset(layout, seat, seed)

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """The agent's answer; to stay if it has none that is an action."""
        start = self._clock()
        action, fault = self._asked(state, tick)
        if tick >= WARM_UP_TICKS:
            self.times_ms.append(1000 * (self._clock() - start))
        self.answers.append(action)
        if fault is not None:
            self.faults.append(fault)
            return STAY
        answer: int = action
        return answer

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Let the agent observe."""
        try:
            self.agent.observe(state, joint_action)
        except Exception as error:  # whatever an agent raises, it is told and the episode goes on
            self.faults.append(_raised("observing", error))

    def _asked(self, state: NDArray[np.int16], tick: int) -> tuple[Any, Fault | None]:
        """The agent's answer, and what is wrong with it."""
        try:
            action: Any = self.agent.act(state, tick)
        except Exception as error:  # as above
            return None, _raised("deciding", error)
        if type(action) is not int or action not in range(len(ACTIONS)):
            return action, Fault(f"{action!r} is no action", f"answer with an int from {_MOVES}")
        return action, None


class _Late:
    """An agent that is too late every few ticks, so that its chef stays whatever it wanted."""

    def __init__(self, agent: Agent) -> None:
        self.reset, self.observe, self._act = agent.reset, agent.observe, agent.act

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """To stay in a tick in which it is late, else the agent's action."""
        action = self._act(state, tick)
        return STAY if tick % LATE_EVERY_TICKS == LATE_EVERY_TICKS - 1 else action


def _raised(doing: str, error: Exception) -> Fault:
    what = str(error) if isinstance(error, GalleyError) else f"{doing} raises {type(error).__name__}: {error}"
    return Fault(what, "catch it, or answer `stay`: any state of a layout that it knows may come up")
