"""Who is let in, who is not and why, and that nothing half-made stays behind."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from onnx import helper

from galley.agents.admission.adding import as_it_is
from galley.agents.catalogue import Catalogue
from galley.errors import GalleyError, InvalidFiles
from tests.agents.admission.newcomers import cole_policy, foreign, let_in, mended, workspace
from tests.agents.policies import linear_policy, model
from tests.serving import run_galley

GRID = (26, 4, 5)


def written(folder: Path, content: bytes, name: str = "policy.onnx") -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


def reasons(tmp_path: Path, files: dict[str, Path], **options: object) -> list[str]:
    place = workspace(tmp_path / "work")
    with pytest.raises(InvalidFiles) as caught:
        let_in(place, files, **options)  # type: ignore[arg-type]
    assert list(place.folder("agents").glob("**/*")) == [], "nothing half-made stays"
    return [str(problem) for problem in caught.value.problems]


def test_the_network_of_the_paper_is_let_in_with_a_card(tmp_path: Path) -> None:
    place = workspace(tmp_path / "work")
    path = written(tmp_path, cole_policy(GRID))
    added = let_in(place, {"hall": path, "den": path}, encoding="grid")
    assert [one.layout for one in added.figures] == ["room", "den"]
    assert all(one.ticks == 400 and 0 < one.decision_p99_ms < 50 for one in added.figures)
    catalogue = Catalogue(place)
    assert catalogue.names() == ("guest",)
    assert catalogue.check() == []
    bundle = catalogue.bundle("guest")
    assert bundle.sha256 == added.sha256
    assert set(bundle.layouts or ()) == {"room", "den"}
    card = (added.path / "card.md").read_text("utf-8")
    for told in (
        hashlib.sha256(path.read_bytes()).hexdigest(),
        "galley agents add ...",
        "| room | `policy.onnx` |",
        "the files are as they came",
        "99th percentile",
    ):
        assert told in card
    assert sorted(entry.name for entry in place.folder("agents").iterdir()) == ["guest"]


def test_all_reasons_are_told_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = iter(range(10**7))
    monkeypatch.setattr("time.thread_time", lambda: 0.06 * next(ticks))
    nan = written(tmp_path, linear_policy(bias=[0, float("nan"), 0, 0, 0, 0]), "nan.onnx")
    files = {"room": nan, "den": written(tmp_path, linear_policy(features=3, outputs=5)), "hal": nan}
    found = "\n".join(reasons(tmp_path, files, name="a b"))
    for expected in (
        "--name: 'a b' is no name for an agent",
        "--layout: no layout is named 'hal'; did you mean 'hall'",
        "policy.onnx: for layout 'den': input 'observation' has shape ['B', 3], not ['B', 62]; output",
        "; output 'logits' has shape ['B', 5], not ['B', 6]",
        "nan.onnx: on layout 'room' room.onnx: the logits hold NaN or infinite numbers",
        "nan.onnx: on layout 'room' decisions are too slow: half of the first 50 took 60.0 ms",
    ):
        assert expected in found
    assert len(found.splitlines()) == 5


def test_unknown_encodings_and_missing_files_are_told(tmp_path: Path) -> None:
    found = reasons(tmp_path, {"room": tmp_path / "none.onnx"}, encoding="gird")
    assert any("encoding 'gird' is unknown; did you mean 'grid'" in one for one in found)
    assert any("none.onnx: no such file" in one for one in found)


def test_networks_that_draw_are_told(tmp_path: Path) -> None:
    noise = helper.make_node("RandomNormalLike", ["plain"], ["noise"], scale=3.0)
    nodes = [
        helper.make_node("MatMul", ["observation", "w"], ["plain"]),
        noise,
        helper.make_node("Add", ["plain", "noise"], ["logits"]),
    ]
    zeros = {"w": np.zeros((62, 6), dtype=np.float32)}
    drawing = model(nodes, {"observation": ["B", 62]}, {"logits": ["B", 6]}, zeros)
    found = "\n".join(reasons(tmp_path, {"room": written(tmp_path, drawing)}))
    assert "with the same seed the agent acts in another way the second time" in found
    assert "answers the same observation in another way the second time" in found


def test_rows_that_hang_on_each_other_are_told(tmp_path: Path) -> None:
    nodes = [
        helper.make_node("MatMul", ["observation", "w"], ["plain"]),
        helper.make_node("ReduceMean", ["plain"], ["mean"], axes=[0], keepdims=1),
        helper.make_node("Sub", ["plain", "mean"], ["logits"]),
    ]
    random = {"w": np.random.default_rng(0).normal(size=(62, 6)).astype(np.float32)}
    mixing = model(nodes, {"observation": ["B", 62]}, {"logits": ["B", 6]}, random)
    found = reasons(tmp_path, {"room": written(tmp_path, mixing)})
    assert "in a batch of 32 the network gives other actions than row by row" in found[0]
    assert len(found) == 1


def test_what_fails_only_in_some_states_is_found(tmp_path: Path) -> None:
    # 1/x of how far the other chef is in x: infinite only when both stand in one column.
    nodes = [
        helper.make_node("Gather", ["observation", "place"], ["apart"], axis=1),
        helper.make_node("Reciprocal", ["apart"], ["one_over"]),
        helper.make_node("MatMul", ["one_over", "w"], ["logits"]),
    ]
    parts = {"w": np.ones((1, 6), dtype=np.float32), "place": np.array([58], dtype=np.int64)}
    failing = model(nodes, {"observation": ["B", 62]}, {"logits": ["B", 6]}, parts)
    found = reasons(tmp_path, {"room": written(tmp_path, failing)})
    assert found[0].startswith(str(tmp_path / "policy.onnx"))
    assert "the logits hold NaN or infinite numbers" in found[0]


def test_foreign_files_are_mended_and_probabilities_never_taken_for_logits(tmp_path: Path) -> None:
    place = workspace(tmp_path / "work")
    path = written(tmp_path, foreign(batch=1, softmax=True))
    added = let_in(place, {"room": path}, convert=mended)
    assert "the softmax at the end taken off" in added.notes["room"]
    assert "the softmax at the end taken off" in (added.path / "card.md").read_text("utf-8")
    shutil.rmtree(added.path)
    assert as_it_is(written(tmp_path, linear_policy()), (62,)).content == linear_policy()
    nodes = [
        helper.make_node("MatMul", ["observation", "w"], ["plain"]),
        helper.make_node("Softmax", ["plain"], ["logits"], axis=1),
    ]
    parts = {"w": np.random.default_rng(0).normal(size=(62, 6)).astype(np.float32)}
    with pytest.raises(GalleyError, match="probabilities, not logits"):
        as_it_is(
            written(tmp_path, model(nodes, {"observation": ["B", 62]}, {"logits": ["B", 6]}, parts)), (62,)
        )


def test_an_agent_is_overwritten_only_when_asked(tmp_path: Path) -> None:
    place = workspace(tmp_path / "work")
    first = let_in(place, {"room": written(tmp_path, linear_policy())})
    second = written(tmp_path, linear_policy(seed=1))
    with pytest.raises(InvalidFiles, match=r"agents/guest: there is an agent of this name; .*--replace"):
        let_in(place, {"room": second})
    assert Catalogue(place).bundle("guest").sha256 == first.sha256
    bad = written(tmp_path, linear_policy(bias=[float("inf")] * 6), "bad.onnx")
    with pytest.raises(InvalidFiles, match="NaN"):
        let_in(place, {"room": bad}, replace=True)
    assert Catalogue(place).bundle("guest").sha256 == first.sha256
    replaced = let_in(place, {"room": second}, replace=True)
    assert Catalogue(place).bundle("guest").sha256 == replaced.sha256 != first.sha256
    assert sorted(entry.name for entry in place.folder("agents").iterdir()) == ["guest"]


def test_the_command_adds_and_rejects(tmp_path: Path) -> None:
    place = workspace(tmp_path / "work")
    written(tmp_path, foreign(softmax=True), "room.onnx")
    written(tmp_path, linear_policy(), "den.onnx")
    common = ["--name", "guest", "--encoding", "overcooked-2019-features", "--workspace", "work", "--json"]
    done = run_galley("agents", "add", "room.onnx", "den.onnx", *common, "--unstuck", "3", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["added"] is True
    assert {one["layout"] for one in told["layouts"]} == {"room", "den"}
    assert told["sha256"] == Catalogue(place).bundle("guest").sha256
    text = (place.folder("agents") / "guest" / "agent.yaml").read_text("utf-8")
    assert "unstuck_after_ticks: 3" in text
    assert "galley agents add room.onnx den.onnx" in (place.folder("agents") / "guest" / "card.md").read_text(
        "utf-8"
    )
    again = run_galley("agents", "add", "room.onnx", "--layout", "den", *common, cwd=tmp_path)
    assert again.returncode == 1
    assert again.stderr.count("\n") == 1
    assert json.loads(again.stdout)["reasons"][0]["file"] == "agents/guest"
    for wrong in (["room.onnx", "--network", "bc-mlp"], ["room.onnx", "den.onnx", "--layout", "room"], []):
        assert run_galley("agents", "add", *wrong, *common, cwd=tmp_path).returncode == 2
