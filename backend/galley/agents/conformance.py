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
from galley.agents.network import DecisionGivenUp
from galley.agents.protocol import Agent
from galley.errors import GalleyError, InvalidFiles
from galley.kitchen import ACTIONS, STAY, Layout
from galley.kitchen.trajectory import play
from galley.progress_lines import Progress, untold

CHECKED_TICKS: Final = 100
WARM_UP_TICKS: Final = 5
LATE_EVERY_TICKS: Final = 7
SEED: Final = 1
SLOWEST_MS: Final = 50.0
"""A third of a tick of 150 ms: the 99th percentile of decision times must stay below."""

PROBED: Final = 50
"""After so many decisions, half of which took too long, an agent is given up."""

PROBED_AT_LEAST: Final = 5
FAR_TOO_SLOW: Final = 10
"""Who is slower than allowed by this factor is given up after the first few decisions."""

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
    nothing could be played. `whole` is False for one that was given up before it had played.
    """

    layout: str
    faults: tuple[Fault, ...]
    score: int
    decision_p50_ms: float
    decision_p99_ms: float
    whole: bool = True


def check(
    make: Callable[[], Agent],
    layout: Layout,
    ticks: int = CHECKED_TICKS,
    think_ms: int | None = None,
    progress: Progress = untold,
) -> Conduct:
    """How agents fresh from `make` play beside themselves for `ticks` ticks, or to the end of the episode.

    They must answer every state with an action, in time; act the same when reset with the same seed, whatever
    came before, and however often they are asked; and act the same when they were only shown what was done.
    An agent that fails in a tick stays, as in a round, and is asked again in the next. One that declares how
    long it may take (`think_ms`) is tried for SLOW_TICKS at most, and its times are those of the wall clock:
    what it waits for counts as well. One that is far too slow is given up after PROBED decisions, and a
    network that has a limit when a decision does not come back.

    Raises:
        InvalidFiles: a file that the agent needs cannot be used.
    """
    nan = float("nan")
    faults: list[Fault] = []
    watch = _Watch(layout.name, think_ms, progress)
    try:
        return _played(make, layout, ticks if think_ms is None else min(ticks, SLOW_TICKS), watch, faults)
    except _TooSlow as slow:
        faults.append(Fault(str(slow), watch.slow_fix))
        return Conduct(layout.name, _once(faults), 0, slow.median_ms, slow.slowest_ms, whole=False)
    except DecisionGivenUp as error:
        faults.append(Fault(str(error), "look for a loop without an end in the network"))
        return Conduct(layout.name, _once(faults), 0, nan, nan, whole=False)


def _played(
    make: Callable[[], Agent], layout: Layout, ticks: int, watch: _Watch, faults: list[Fault]
) -> Conduct:
    """The conduct of agents that play to the end; what is found on the way goes to `faults`."""
    nan = float("nan")
    first, again = (tuple(_Watched(make(), faults, watch) for _ in range(2)) for _ in range(2))
    try:
        watch.begins("plays beside itself", ticks, probe=True)
        played = play_episode(layout, (first[0], first[1]), SEED, ticks)
        watch.begins("plays it again", ticks)
        play_episode(layout, (again[0], again[1]), SEED, ticks)
    except (InvalidFiles, DecisionGivenUp):
        raise
    except GalleyError as error:
        unknown = Fault(str(error), "name only layouts that it knows")
        return Conduct(layout.name, (unknown,), 0, nan, nan, whole=False)
    if [one.answers for one in first] != [one.answers for one in again]:
        faults.append(
            Fault(
                "with the same seed the agent acts in another way the second time",
                "draw with galley.compiled.randomness.uniform(seed, seat, tick), from no clock or generator",
            )
        )
    times_ms = [spent for one in first for spent in one.times_ms] or [0.0]
    slowest = float(np.percentile(times_ms, 99))
    if slowest > watch.most_ms:
        what = f"decisions are slow: 99th percentile {slowest:.1f} ms, more than {watch.most_ms:.0f} ms"
        faults.append(Fault(what, watch.slow_fix))
    if not faults:
        watch.begins("is shown what was done", ticks)
        faults += _seen_only(make, again[0].agent, layout, ticks, watch)
    score = play(layout, played.joint_actions).score
    return Conduct(layout.name, _once(faults), score, float(np.median(times_ms)), slowest)


def _once(faults: list[Fault]) -> tuple[Fault, ...]:
    return tuple(dict.fromkeys(faults))


def _seen_only(
    make: Callable[[], Agent], used: Agent, layout: Layout, ticks: int, watch: _Watch
) -> list[Fault]:
    """What is wrong with agents that are shown an episode and asked from the middle on.

    One is fresh; the other, `used`, played an episode on the other seat before it is reset.
    """
    faults: list[Fault] = []
    other, asked = _Late(make()), _Watched(make(), faults, watch)
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
        shown = _Watched(agent, faults, watch)
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


class _TooSlow(Exception):
    """Half of the decisions so far took longer than any may."""

    def __init__(self, times_ms: list[float], most_ms: float) -> None:
        self.median_ms = float(np.median(times_ms))
        self.slowest_ms = float(np.percentile(times_ms, 99))
        super().__init__(
            f"decisions are too slow: half of the first {len(times_ms)} took {self.median_ms:.1f} ms or "
            f"more, where {most_ms:.0f} ms is the most"
        )


class _Watch:
    """Times the decisions on a layout, tells how far the check has come, and gives up who is too slow."""

    def __init__(self, layout: str, think_ms: int | None, progress: Progress) -> None:
        self.most_ms = SLOWEST_MS if think_ms is None else float(think_ms)
        self.slow_fix = "work out in `reset` what can be known before, or plan less far"
        self.clock: Callable[[], float] = time.thread_time
        if think_ms is not None:
            self.slow_fix = "declare a longer think_ms in agent.yaml"
            self.clock = time.monotonic
        self._layout = layout
        self._progress = progress
        self.begins("", 0)

    def begins(self, doing: str, ticks: int, *, probe: bool = False) -> None:
        """Another episode begins, whose first decisions say whether it is worth going on, or not."""
        self._doing, self._ticks = doing, ticks
        self._probed: list[float] | None = [] if probe else None

    def decided(self, tick: int, spent_ms: float) -> None:
        """Note a decision.

        Raises:
            _TooSlow: there is no hope.
        """
        self._progress(f"on {self._layout} {self._doing}, tick", tick, self._ticks)
        if self._probed is None or tick < WARM_UP_TICKS:
            return
        self._probed.append(spent_ms)
        count = len(self._probed)
        if count == PROBED or (count >= PROBED_AT_LEAST and min(self._probed) > FAR_TOO_SLOW * self.most_ms):
            if np.median(self._probed) > self.most_ms:
                raise _TooSlow(self._probed, self.most_ms)
            self._probed = None


class _Watched:
    """An agent whose `answers`, `times_ms` and `faults` are noted, and which stays when it fails."""

    def __init__(self, agent: Agent, faults: list[Fault], watch: _Watch) -> None:
        self._watch = watch
        self.agent = agent
        self.faults = faults
        self.answers: list[Any] = []
        self.times_ms: list[float] = []

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode."""
        self.agent.reset(layout, seat, seed)

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """The agent's answer; to stay if it has none that is an action."""
        start = self._watch.clock()
        action, fault = self._asked(state, tick)
        spent_ms = 1000 * (self._watch.clock() - start)
        if tick >= WARM_UP_TICKS:
            self.times_ms.append(spent_ms)
        self.answers.append(action)
        if fault is not None:
            self.faults.append(fault)
        self._watch.decided(tick, spent_ms)
        if fault is not None:
            return STAY
        answer: int = action
        return answer

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Let the agent observe."""
        try:
            self.agent.observe(state, joint_action)
        except DecisionGivenUp:
            raise
        except Exception as error:  # whatever an agent raises, it is told and the episode goes on
            self.faults.append(_raised("observing", error))

    def _asked(self, state: NDArray[np.int16], tick: int) -> tuple[Any, Fault | None]:
        """The agent's answer, and what is wrong with it."""
        try:
            action: Any = self.agent.act(state, tick)
        except DecisionGivenUp:
            raise
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
