"""Every agent that ships, on every layout that it knows, keeps the promises of the agent protocol."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from galley.agents.admission.trial import trial
from galley.agents.batch import act_all
from galley.agents.bundle import Bundle
from galley.agents.catalogue import Catalogue
from galley.agents.protocol import Agent
from galley.kitchen import STAY, Kitchen, Layout
from galley.kitchen.layout_file import find_layout
from galley.workspace import Workspace

WORKSPACE = Workspace(Path(__file__).resolve().parents[2])
CATALOGUE = Catalogue(WORKSPACE)
TICKS = 120
QUICK = ("cramped_room", "counter_circuit")
QUICK_CENTRALIZED = ("cramped_room",)


def cases() -> Iterator[object]:
    """Every agent on every layout that it knows; planners and scripts on most of them only with `full`."""
    for name in CATALOGUE.names():
        bundle = CATALOGUE.bundle(name)
        for layout in bundle.layouts or WORKSPACE.names("layouts"):
            quick = bundle.kind == "network" or layout in (
                QUICK_CENTRALIZED if name == "centralized" else QUICK
            )
            marks = () if quick else (pytest.mark.full, pytest.mark.timeout(1800))
            yield pytest.param(name, layout, id=f"{name}-{layout}", marks=marks)


CASES = list(cases())

Record = list[tuple[NDArray[np.int16], tuple[int, int]]]


def seated(bundle: Bundle, layout: Layout, seat: int, seed: int) -> Agent:
    agent = bundle.make()
    agent.reset(layout, seat, seed)
    return agent


def played(bundle: Bundle, layout: Layout, seed: int) -> Record:
    """States and joint actions of an agent beside itself; every seventh action of seat 0 comes too late."""
    kitchen = Kitchen(layout)
    pair = [seated(bundle, layout, seat, seed) for seat in (0, 1)]
    record: Record = []
    for tick in range(TICKS):
        state = kitchen.state.copy()
        wished = [agent.act(state, tick) for agent in pair]
        joint = (STAY if tick % 7 == 6 else wished[0], wished[1])
        assert all(type(action) is int and 0 <= action <= 5 for action in wished)
        kitchen.step(*joint)
        for agent in pair:
            agent.observe(state, joint)
        record.append((state, joint))
    return record


@pytest.mark.parametrize(("name", "layout_name"), CASES)
def test_agents_keep_their_promises(name: str, layout_name: str) -> None:
    bundle, layout = CATALOGUE.bundle(name), find_layout(WORKSPACE, layout_name)
    record = played(bundle, layout, seed=11)
    again = played(bundle, layout, seed=11)
    assert [joint for _, joint in again] == [joint for _, joint in record], "equal seeds, equal games"

    taken_over = seated(bundle, layout, 1, 11)
    used_before = seated(bundle, layout, 0, 5)
    for state, joint in played(bundle, layout, seed=5)[:40]:
        used_before.observe(state, joint)
    used_before.reset(layout, 1, 11)
    for tick, (state, joint) in enumerate(record):
        if tick >= TICKS // 2:  # only now is it asked: what it saw must be enough
            assert taken_over.act(state, tick) == joint[1], "an agent that takes over acts the same"
            assert used_before.act(state, tick) == joint[1], "reset forgets everything"
        taken_over.observe(state, joint)
        used_before.observe(state, joint)


@pytest.mark.parametrize(("name", "layout_name"), CASES)
def test_many_at_once_act_as_each_alone(name: str, layout_name: str) -> None:
    bundle, layout = CATALOGUE.bundle(name), find_layout(WORKSPACE, layout_name)
    records = [played(bundle, layout, seed) for seed in (1, 2, 3)]
    agents = [seated(bundle, layout, 1, seed) for seed in (1, 2, 3)]
    for tick in range(TICKS):
        states = [record[tick][0] for record in records]
        joints = [record[tick][1] for record in records]
        assert act_all(agents, states, [tick] * 3) == [joint[1] for joint in joints]
        for agent, state, joint in zip(agents, states, joints, strict=True):
            agent.observe(state, joint)


@pytest.mark.parametrize(("name", "layout_name"), CASES)
def test_the_check_finds_nothing(name: str, layout_name: str) -> None:
    assert trial(CATALOGUE.bundle(name), find_layout(WORKSPACE, layout_name)).problems == ()


def test_the_agents_of_the_demo_ship() -> None:
    assert {"stay", "random", "myopic", "human-bc", "human-proxy"} <= set(CATALOGUE.names())


@pytest.mark.parametrize(
    "name", [name for name in CATALOGUE.names() if CATALOGUE.bundle(name).kind == "network"]
)
def test_networks_come_with_a_card(name: str) -> None:
    card = (CATALOGUE.bundle(name).path / "card.md").read_text("utf-8")
    if name.startswith("human"):
        expected = ["Data", "SHA-256", "Command", "--seed", "held out", "score"]
    else:
        layouts = CATALOGUE.bundle(name).layouts or ()
        expected = ["--seed", "of the paper's", "minutes", "commit", "with itself", "human-proxy"]
        expected += [f"galley learn train {name} --layout {layout}" for layout in layouts]
        expected += [f"| {layout} | " for layout in layouts]
    for told in expected:
        assert told in card


def test_the_human_proxy_is_said_to_be_a_measuring_stick() -> None:
    card = (CATALOGUE.bundle("human-proxy").path / "card.md").read_text("utf-8")
    assert "measuring stick" in card
    assert "no agent\nmay ever be trained" in card
    assert "clean_test_trials" in card
    assert "clean_train_trials" in (CATALOGUE.bundle("human-bc").path / "card.md").read_text("utf-8")
