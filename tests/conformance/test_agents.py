"""Every agent that ships, on every layout that it knows, keeps the promises of the agent protocol."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.agents.agent_batch import act_all
from galley.agents.catalogue import Catalogue
from galley.agents.conformance import check
from galley.agents.episode import play_episode
from galley.kitchen.layout_file import find_layout
from galley.kitchen.trajectory import replay
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


@pytest.mark.parametrize(("name", "layout_name"), CASES)
def test_agents_keep_their_promises(name: str, layout_name: str) -> None:
    assert check(CATALOGUE.bundle(name).make, find_layout(WORKSPACE, layout_name), TICKS).faults == ()


@pytest.mark.parametrize(("name", "layout_name"), CASES)
def test_many_at_once_act_as_each_alone(name: str, layout_name: str) -> None:
    bundle, layout = CATALOGUE.bundle(name), find_layout(WORKSPACE, layout_name)
    played = [play_episode(layout, (bundle.make(), bundle.make()), seed, TICKS) for seed in (1, 2, 3)]
    agents = [bundle.make() for _ in played]
    for agent, seed in zip(agents, (1, 2, 3), strict=True):
        agent.reset(layout, 1, seed)
    for tick in range(TICKS):
        states = [replay(one)[tick] for one in played]
        joints = [one.joint_actions[tick].tolist() for one in played]
        assert act_all(agents, states, [tick] * 3) == [joint[1] for joint in joints]
        for agent, state, joint in zip(agents, states, joints, strict=True):
            agent.observe(state, (joint[0], joint[1]))


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
