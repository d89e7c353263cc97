"""Agents that do not come back from a decision, or hardly: given up soon and told in one line."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from galley.agents.admission import adding
from galley.agents.catalogue import Catalogue
from galley.agents.network import DecisionGivenUp, Network
from galley.errors import InvalidFiles
from galley.progress_lines import ProgressLines, ends_within
from tests.agents.admission.newcomers import let_in, workspace
from tests.agents.policies import linear_policy, write_bundle

APART = 58
"""The feature that says how far the other chef is in x."""


def looping(*, at: float | None, rounds: int = 2**62) -> bytes:
    """A linear policy that goes around in circles, always or where a chef is `at` so far from the other."""
    value = helper.make_tensor_value_info
    body = helper.make_graph(
        [helper.make_node("Identity", ["goes_in"], ["goes"]), helper.make_node("Identity", ["x_in"], ["x"])],
        "body",
        [value("i", TensorProto.INT64, []), value("goes_in", TensorProto.BOOL, []), value("x_in", 1, None)],
        [value("goes", TensorProto.BOOL, []), value("x", 1, None)],
    )
    random = np.random.default_rng(0).normal(size=(62, 6)).astype(np.float32)
    constants = [
        numpy_helper.from_array(random, "w"),
        numpy_helper.from_array(np.array([APART], dtype=np.int64), "place"),
        numpy_helper.from_array(np.array(at or 0, dtype=np.float32), "where"),
        numpy_helper.from_array(np.array(rounds, dtype=np.int64), "rounds"),
        numpy_helper.from_array(np.array(True), "yes"),
    ]
    nodes = [
        helper.make_node("MatMul", ["observation", "w"], ["plain"]),
        helper.make_node("Gather", ["observation", "place"], ["apart"], axis=1),
        helper.make_node("Equal", ["apart", "where"], ["here"]),
        helper.make_node("Cast", ["here"], ["as_number"], to=TensorProto.FLOAT),
        helper.make_node("ReduceMax", ["as_number"], ["anywhere"], keepdims=0),
        helper.make_node("Cast", ["anywhere"], ["triggered"], to=TensorProto.BOOL),
        helper.make_node(
            "Loop", ["rounds", "yes" if at is None else "triggered", "plain"], ["logits"], body=body
        ),
    ]
    graph = helper.make_graph(
        nodes, "policy", [value("observation", 1, ["B", 62])], [value("logits", 1, ["B", 6])], constants
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    return bytes(made.SerializeToString())


def written(folder: Path, content: bytes) -> Path:
    path = folder / "policy.onnx"
    path.write_bytes(content)
    return path


def test_d11_a_run_that_does_not_come_back_is_given_up_and_the_next_one_is_not(tmp_path: Path) -> None:
    network = Network(written(tmp_path, looping(at=-1)), (62,), limit_s=0.5)
    seen = np.zeros((1, 62), dtype=np.float32)
    before = network.run(seen)[0]
    seen[0, APART] = -1
    with pytest.raises(DecisionGivenUp, match=r"policy.onnx: a decision did not come back within 0.5 s"):
        network.run(seen)
    seen[0, APART] = 0
    assert np.array_equal(network.run(seen)[0], before)


@pytest.mark.parametrize("at", [None, -1.0])
def test_d11_an_agent_that_never_returns_is_refused_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: float | None
) -> None:
    monkeypatch.setattr(adding, "DECISION_S", 0.5)
    place = workspace(tmp_path / "work")
    with pytest.raises(InvalidFiles) as caught:
        let_in(place, {"room": written(tmp_path, looping(at=at))})
    (problem,) = caught.value.problems
    assert "a decision did not come back within 0.5 s" in str(problem)
    assert list(place.folder("agents").glob("**/*")) == []


def test_d11_the_check_of_a_workspace_gives_it_up_and_goes_on_with_the_others(tmp_path: Path) -> None:
    place = workspace(tmp_path)
    write_bundle(tmp_path / "agents", looping(at=None), name="a")
    write_bundle(tmp_path / "agents", linear_policy(features=3), name="b")
    told = [str(problem) for problem in Catalogue(place, limit_s=0.5).check()]
    assert len(told) == 2
    assert told[0].startswith(
        "agents/a/agent.yaml:8: on layout 'room' room.onnx: a decision did not come back"
    )
    assert told[1].startswith("agents/b/agent.yaml:8: room.onnx: input 'observation' has shape")


def test_d11_a_slow_network_is_refused_with_its_figures_before_the_whole_gate(tmp_path: Path) -> None:
    slow = looping(at=None, rounds=100_000)
    once = Network(written(tmp_path, slow), (62,))
    once.run(np.zeros((1, 62), dtype=np.float32))
    began_s = time.thread_time()
    once.run(np.zeros((1, 62), dtype=np.float32))
    decision_s = time.thread_time() - began_s
    assert decision_s > 0.06, "slow enough on this machine"
    began_s = time.thread_time()
    with pytest.raises(
        InvalidFiles, match=r"decisions are too slow: half of the first \d+ took .* ms or more"
    ):
        let_in(workspace(tmp_path / "work"), {"room": written(tmp_path, slow)})
    assert time.thread_time() - began_s < 200 * decision_s, "of more than 13,000 in the gate"


def test_d11_the_command_ends_with_one_line(tmp_path: Path) -> None:
    """As `galley agents add` runs it, with less patience."""
    workspace(tmp_path / "work")
    written(tmp_path, looping(at=-1))
    program = (
        "import sys; from galley.agents.admission import adding; adding.DECISION_S = 1.0; "
        "from galley.cli import main; main()"
    )
    command = "agents add policy.onnx --layout room --name guest --encoding overcooked-2019-features"
    done = subprocess.run(
        [sys.executable, "-c", program, *command.split(), "--workspace", "work"],
        cwd=tmp_path, capture_output=True, text=True, timeout=200, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "a decision did not come back within 1 s" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_d11_what_runs_without_end_while_it_is_converted_ends_the_program_with_a_line() -> None:
    program = (
        "from galley.progress_lines import ends_within\n"
        "with ends_within(0.5, 'it does not end'):\n    while True: pass"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (1, "it does not end\n")
    with ends_within(0.01, "never told"):
        pass
    time.sleep(0.05)


def test_d11_progress_is_told_only_of_what_takes_long(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = [0.0]
    monkeypatch.setattr("galley.progress_lines.time.monotonic", lambda: now[0])
    lines = ProgressLines()
    for tick in range(100):
        now[0] = tick / 10
        lines("on room, tick", tick, 100)
    assert capsys.readouterr().err.splitlines() == [
        "on room, tick: 30 of 100 (3 s)", "on room, tick: 80 of 100 (8 s)"
    ]  # fmt: skip
