"""Bundles: everything wrong with one is told at once, with its line and the way to mend it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from onnx import helper

from galley.agents.bundle import load_bundle
from galley.errors import InvalidFiles
from galley.planning.myopic import Myopic
from tests.agents.policies import ROOM, bundle, linear_policy, model, write_bundle


def told(folder: Path) -> list[str]:
    with pytest.raises(InvalidFiles) as caught:
        load_bundle(folder, f"agents/{folder.name}")
    return [str(problem) for problem in caught.value.problems]


def described(folder: Path, text: str) -> Path:
    place = folder / "chef"
    place.mkdir()
    (place / "agent.yaml").write_text(text, encoding="utf-8")
    return place


def test_all_problems_of_a_network_are_told(tmp_path: Path) -> None:
    place = described(
        tmp_path,
        "format: 1\nname: cook\nkind: network\nencoding: overcooked-2019-gird\nparams: {policy: stay}\n"
        "layouts:\n  room: romm.onnx\n  hall: ../hall.onnx\n",
    )
    (place / "room.onnx").write_bytes(b"")
    found = "\n".join(told(place))
    for expected in (
        "agents/chef/agent.yaml:2: name 'cook' is not that of the folder; write name: chef",
        "agents/chef/agent.yaml:4: encoding 'overcooked-2019-gird' is unknown; did you mean",
        "agents/chef/agent.yaml:5: a network has no params",
        "agents/chef/agent.yaml:7: there is no file romm.onnx; did you mean 'room.onnx'",
        "agents/chef/agent.yaml:8: '../hall.onnx' is no plain file name",
        "a network needs the key 'sampling'; add sampling: sample or argmax",
        "a network needs the key 'unstuck_after_ticks'",
    ):
        assert expected in found


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("params: {policy: myopc}", "5: no planner policy is named 'myopc'; did you mean 'myopic'"),
        ("params: {policy: stay}", "5: no planner policy is named 'stay'"),
        ("params: {policy: myopic, epsilon: 2}", "5: epsilon is 2; write a number from 0 to 1"),
        ("params: {policy: myopic, epsilom: 0.1}", "5: the policy has no parameter 'epsilom'; did you mean"),
        ("params: {}", "5: no policy is named; add params: {policy: myopic}"),
        ("encoding: grid", "5: a planner agent has no 'encoding'"),
        ("epsilon: 1", "5: "),
    ],
)
def test_problems_of_planners(tmp_path: Path, line: str, message: str) -> None:
    place = described(tmp_path, f"format: 1\nname: chef\nkind: planner\nlayouts: any\n{line}\n")
    assert any(one.startswith(f"agents/chef/agent.yaml:{message}") for one in told(place))


def test_a_planner_takes_its_parameters(tmp_path: Path) -> None:
    text = "format: 1\nname: chef\nkind: planner\nlayouts: any\nparams: {policy: myopic, epsilon: 0.25}\n"
    loaded = load_bundle(described(tmp_path, text), "agents/chef")
    agent = loaded.make()
    assert isinstance(agent, Myopic)
    assert agent.epsilon == 0.25
    assert loaded.layouts is None
    assert loaded.supports("anything")


def network_trouble(folder: Path, policy: bytes) -> str:
    loaded = bundle(folder, policy)
    with pytest.raises(InvalidFiles) as caught:
        loaded.make().reset(ROOM, 0, 0)
    return str(caught.value)


def test_files_that_are_not_such_policies_are_told_with_shapes(tmp_path: Path) -> None:
    place = "agents/chef/agent.yaml:8: room.onnx: "
    cases = {
        b"no onnx": "the file is not ONNX that can be run",
        linear_policy(features=20): r"input 'observation' has shape ['B', 20], not ['B', 62]",
        linear_policy(outputs=5): r"output 'logits' has shape ['B', 5], not ['B', 6]",
        linear_policy().replace(
            b"observation", b"observatiom"
        ): "the inputs are ['observatiom'], not ['observation']",
    }
    for number, (policy, message) in enumerate(cases.items()):
        assert (place + message) in network_trouble(tmp_path / str(number), policy)


def test_a_fixed_batch_is_refused(tmp_path: Path) -> None:
    node = helper.make_node("Slice", ["observation", "from", "to", "axis"], ["logits"])
    numbers = {
        name: np.array([value], dtype=np.int64) for name, value in (("from", 0), ("to", 6), ("axis", 1))
    }
    fixed = model([node], {"observation": [1, 62]}, {"logits": [1, 6]}, numbers)
    assert "with a dynamic batch size B" in network_trouble(tmp_path, fixed)


def test_the_hash_covers_every_file(tmp_path: Path) -> None:
    place = write_bundle(tmp_path, linear_policy())
    before = load_bundle(place, "chef").sha256
    assert load_bundle(place, "chef").sha256 == before
    (place / "card.md").write_text("made by hand", encoding="utf-8")
    with_card = load_bundle(place, "chef").sha256
    (place / "room.onnx").write_bytes(linear_policy(seed=1))
    assert len({before, with_card, load_bundle(place, "chef").sha256}) == 3
    (place / ".notes").write_text("mine", encoding="utf-8")
    assert len({before, with_card, load_bundle(place, "chef").sha256}) == 3


def test_networks_are_shared_by_the_agents_of_a_bundle(tmp_path: Path) -> None:
    loaded = bundle(tmp_path, linear_policy())
    assert loaded.network(ROOM)[0] is loaded.network(ROOM)[0]
    assert loaded.supports("room")
    assert not loaded.supports("hall")


def test_a_bundle_says_how_long_its_agent_may_take_and_whether_it_repeats(tmp_path: Path) -> None:
    text = "format: 1\nname: chef\nkind: scripted\nparams: {policy: stay}\nlayouts: any\n"
    plain = load_bundle(described(tmp_path, text), "agents/chef")
    assert (plain.think_ms, plain.repeats) == (None, False)
    (tmp_path / "slow").mkdir()
    slow = load_bundle(described(tmp_path / "slow", text + "think_ms: 400\nrepeats: true\n"), "agents/chef")
    assert (slow.think_ms, slow.repeats) == (400, True)
    (tmp_path / "wrong").mkdir()
    (problem,) = told(described(tmp_path / "wrong", text + "think_ms: 0\n"))
    assert problem.startswith("agents/chef/agent.yaml:6: ")
