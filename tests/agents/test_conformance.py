"""The check of an agent's promises finds each that is broken, and says how to mend it."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest
from numpy.typing import NDArray

from galley.agents.conformance import check
from galley.agents.protocol import Agent
from galley.agents.scripted import Random, Stay
from galley.errors import GalleyError
from galley.kitchen import STAY, Layout
from tests.agents.policies import ROOM

State = NDArray[np.int16]


def test_agents_that_keep_their_promises_pass() -> None:
    for agent in (Stay, Random):
        found = check(agent, ROOM)
        assert found.faults == ()
        assert (found.layout, found.score) == ("room", 0)
        assert 0 <= found.decision_p50_ms <= found.decision_p99_ms < 50


class Raising(Stay):
    def act(self, state: State, tick: int) -> int:
        raise KeyError("soup")


class RaisingWhenShown(Stay):
    def observe(self, state: State, joint_action: tuple[int, int]) -> None:
        raise KeyError("soup")


class Wild(Stay):
    def act(self, state: State, tick: int) -> int:
        return 6 if tick == 3 else STAY


class Numpy(Stay):
    def act(self, state: State, tick: int) -> int:
        return np.int64(STAY)  # type: ignore[return-value]


class Drawing(Stay):
    drawn = np.random.default_rng(1)

    def act(self, state: State, tick: int) -> int:
        return int(self.drawn.integers(6))


class Remembering(Stay):
    """Walks on from what it is asked, not from what was done."""

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        self.asked = 0

    def act(self, state: State, tick: int) -> int:
        self.asked += 1
        return self.asked % 6


class Wishing(Stay):
    """Takes it that what it wanted was done."""

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        self.wish: int | None = None

    def act(self, state: State, tick: int) -> int:
        self.wish = tick % 6
        return self.wish

    def observe(self, state: State, joint_action: tuple[int, int]) -> None:
        if self.wish is None:
            raise ValueError("never asked")


class Clinging(Stay):
    """Does not forget the episode before."""

    def __init__(self) -> None:
        self.noted = 0

    def act(self, state: State, tick: int) -> int:
        return self.noted // 100 % 6

    def observe(self, state: State, joint_action: tuple[int, int]) -> None:
        self.noted += 1


class Strange(Stay):
    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        raise GalleyError(f"no such kitchen as {layout.name}")


@pytest.mark.parametrize(
    ("agent", "what", "fix"),
    [
        (Raising, "deciding raises KeyError: 'soup'", "answer `stay`"),
        (RaisingWhenShown, "observing raises KeyError: 'soup'", "catch it"),
        (Wild, "6 is no action", "answer with an int from 0 to 5 (north, south, east"),
        (Numpy, "np.int64(4) is no action", "answer with an int"),
        (Drawing, "with the same seed the agent acts in another way the second time", "randomness.uniform"),
        (Remembering, "an agent that takes over", "remember in `observe`"),
        (Remembering, "asked twice in one tick", "change nothing in `act`"),
        (Wishing, "observing raises ValueError: never asked", "catch it"),
        (Clinging, "reset after another episode", "forget everything in `reset`"),
        (Strange, "no such kitchen as room", "name only layouts that it knows"),
    ],
)
def test_broken_promises_are_told_with_their_mending(agent: type[Agent], what: str, fix: str) -> None:
    assert any(str(one).startswith(what) and fix in one.fix for one in check(agent, ROOM).faults)


class Sleeping(Stay):
    """An agent that waits for something, at no cost of the processor."""

    def act(self, state: State, tick: int) -> int:
        time.sleep(0.01)
        return STAY


def test_who_declares_how_long_it_may_take_is_held_to_it_by_the_wall_clock() -> None:
    assert check(Sleeping, ROOM, ticks=20).faults == ()
    found = check(Sleeping, ROOM, think_ms=1000)
    assert found.faults == ()
    assert found.decision_p50_ms >= 10
    (fault,) = check(Sleeping, ROOM, think_ms=5).faults
    assert "more than 5 ms" in fault.what
    assert "think_ms" in fault.fix


def test_each_kind_of_fault_is_told_once() -> None:
    assert len(check(Raising, ROOM).faults) == 1


def test_slowness_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter(itertools.accumulate(itertools.cycle([0.0, 0.01, 0.0, 0.01, 0.0, 0.06])))
    monkeypatch.setattr("time.thread_time", lambda: next(now))
    (found,) = check(Stay, ROOM).faults
    assert found.what == "decisions are slow: 99th percentile 60.0 ms, more than 50 ms"
    assert "reset" in found.fix


@pytest.mark.parametrize(
    ("decision_ms", "asked", "told"),
    [(119.3, 60, "first 50 took 119.3 ms"), (2000, 15, "first 5 took 2000.0 ms")],
)
def test_d11_who_is_too_slow_is_given_up_after_the_first_decisions(
    monkeypatch: pytest.MonkeyPatch, decision_ms: float, asked: int, told: str
) -> None:
    readings = itertools.count()
    monkeypatch.setattr("time.thread_time", lambda: decision_ms / 1000 * next(readings))
    found = check(Stay, ROOM, ticks=400)
    (fault,) = found.faults
    assert told in fault.what
    assert "where 50 ms is the most" in fault.what
    assert found.decision_p50_ms == pytest.approx(decision_ms)
    assert not found.whole
    assert next(readings) // 2 <= asked, "no more decisions than it takes to know"


def test_d11_how_far_the_check_has_come_is_told() -> None:
    told: list[tuple[str, int, int]] = []
    check(Stay, ROOM, ticks=20, progress=lambda *row: told.append(row))
    assert {what for what, _, _ in told} == {
        f"on room {doing}, tick"
        for doing in ("plays beside itself", "plays it again", "is shown what was done")
    }
    assert all(0 <= done < of == 20 for _, done, of in told)
