"""A network that fails in the middle of rounds costs one agent a tick, and no other anything."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from onnx import helper

from galley.agents.network import NetworkAgent
from galley.errors import GalleyError
from galley.kitchen import STAY, Kitchen
from galley.server.rounds.minds import Mind, Question
from galley.server.rounds.thinking import Thinking
from tests.agents.policies import ROOM, bundle, model

APART_X = 58
"""The feature that says how far the other chef is in x."""


def failing_policy() -> bytes:
    """Logits 1/x of how far the other chef is in x: NaN while both stand in one column."""
    nodes = [
        helper.make_node("Gather", ["observation", "place"], ["apart"], axis=1),
        helper.make_node("Div", ["apart", "apart"], ["one"]),
        helper.make_node("MatMul", ["one", "w"], ["logits"]),
    ]
    parts = {"w": np.arange(6, dtype=np.float32)[None], "place": np.array([APART_X], dtype=np.int64)}
    return model(nodes, {"observation": ["B", 62]}, {"logits": ["B", 6]}, parts)


def failing_memory() -> bytes:
    """A recurrent policy whose state counts ticks but becomes NaN while both stand in one column."""
    nodes = [
        helper.make_node("Gather", ["observation", "place"], ["apart"], axis=1),
        helper.make_node("Div", ["apart", "apart"], ["one"]),
        helper.make_node("Add", ["state_in", "one"], ["state_out"]),
        helper.make_node("MatMul", ["observation", "w"], ["logits"]),
    ]
    parts = {"w": np.zeros((62, 6), dtype=np.float32), "place": np.array([APART_X], dtype=np.int64)}
    return model(
        nodes,
        {"observation": ["B", 62], "state_in": ["B", 1]},
        {"logits": ["B", 6], "state_out": ["B", 1]},
        parts,
    )


GOOD = Kitchen(ROOM).state.copy()
BAD = GOOD.copy()
BAD[0] = BAD[3] + ROOM.width  # seat 0 below seat 1


@pytest.fixture
def thinking() -> Iterator[Thinking]:
    thread = Thinking(window_s=0.02)
    thread.start()
    yield thread
    thread.stop()


def answered(questions: list[Question]) -> list[tuple[int | None, str | None]]:
    until = time.monotonic() + 60
    while any(question.answer is None for question in questions) and time.monotonic() < until:
        time.sleep(0.002)
    return [(one.answer.action, one.answer.fault) for one in questions if one.answer is not None]


def test_one_of_many_fails_for_a_tick_and_comes_back(tmp_path: Path, thinking: Thinking) -> None:
    shared = bundle(tmp_path, failing_policy(), sampling="argmax", unstuck="none")
    agents = [shared.make() for _ in range(5)]
    for agent in agents:
        agent.reset(ROOM, 0, 1)
    minds = [Mind(thinking, agent, "chef") for agent in agents]
    for tick, bad in enumerate((False, True, False)):
        states = [BAD if bad and number == 2 else GOOD for number in range(5)]
        found = answered(
            [mind.ask(tick, state, (GOOD, (STAY, STAY))) for mind, state in zip(minds, states, strict=True)]
        )
        fine = [one for number, one in enumerate(found) if number != 2]
        assert fine == [(5, None)] * 4
        assert found[2] == ((None, "error") if bad else (5, None))


def test_a_memory_never_takes_in_what_is_no_number(tmp_path: Path) -> None:
    agent = bundle(tmp_path, failing_memory(), sampling="argmax", unstuck="none").make()
    agent.reset(ROOM, 0, 1)
    assert isinstance(agent, NetworkAgent)
    agent.observe(GOOD, (STAY, STAY))
    with pytest.raises(GalleyError, match=r"room\.onnx: 'state_out' holds NaN"):
        agent.act(BAD, 1)
    with pytest.raises(GalleyError, match="'state_out' holds NaN"):
        agent.observe(BAD, (STAY, STAY))
    assert agent.act(GOOD, 2) == 0
    agent.observe(GOOD, (STAY, STAY))
    assert agent.alone.memories is not None
    assert agent.alone.memories.tolist() == [[2.0]]
