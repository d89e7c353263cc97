"""The catalogue's check names what is wrong with every agent of a workspace."""

from __future__ import annotations

from pathlib import Path

import pytest

from galley.agents.catalogue import Catalogue, problems_on
from galley.agents.scripted import Stay
from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.workspace import Workspace
from tests.agents.policies import ROOM, bundle, linear_policy, write_bundle

ROOM_FILE = """\
format: 1
title: Room
aliases: []
source: drawn for a test
rules:
  rule_set: classic
  cook_time_ticks: 20
  delivery_reward: 20
  horizon_ticks: 400
grid: |
  XXPXX
  O  2O
  X1  X
  XDXSX
"""


def workspace(folder: Path) -> Workspace:
    (folder / "layouts").mkdir()
    (folder / "layouts" / "room.yaml").write_text(ROOM_FILE, encoding="utf-8")
    return Workspace(folder)


def test_good_agents_pass(tmp_path: Path) -> None:
    write_bundle(tmp_path / "agents", linear_policy())
    catalogue = Catalogue(workspace(tmp_path))
    assert catalogue.names() == ("chef",)
    assert catalogue.check() == []
    assert catalogue.bundle("chef") is catalogue.bundle("chef")


def test_all_agents_are_told_of_and_wrong_layouts_too(tmp_path: Path) -> None:
    agents = tmp_path / "agents"
    write_bundle(agents, linear_policy(bias=[float("inf"), 0, 0, 0, 0, 0]), name="a")
    write_bundle(agents, linear_policy(features=3), name="b")
    place = write_bundle(agents, linear_policy(), name="c")
    text = (place / "agent.yaml").read_text("utf-8")
    (place / "agent.yaml").write_text(text + "  rom: room.onnx\n  broken: room.onnx\n", encoding="utf-8")
    (write_bundle(agents, linear_policy(), name="d") / "room.onnx").unlink()
    there = workspace(tmp_path)
    (tmp_path / "layouts" / "broken.yaml").write_text(ROOM_FILE.replace("XXPXX", "XXQXX"), encoding="utf-8")
    found = "\n".join(str(problem) for problem in Catalogue(there).check())
    for expected in (
        "agents/a/agent.yaml:8: on layout 'room' room.onnx: the logits hold NaN or infinite numbers",
        "agents/b/agent.yaml:8: room.onnx: input 'observation' has shape",
        "agents/c/agent.yaml:9: layout 'rom' is not in the workspace; did you mean 'room'",
        "agents/d/agent.yaml:8: there is no file room.onnx",
        "layouts/broken.yaml:11: tile 'Q' is unknown",
    ):
        assert expected in found
    assert len(found.splitlines()) == 5


def test_an_unknown_agent_is_told_with_the_nearest(tmp_path: Path) -> None:
    write_bundle(tmp_path / "agents", linear_policy())
    with pytest.raises(GalleyError, match="no agent is named 'chev'; did you mean 'chef'"):
        Catalogue(workspace(tmp_path)).bundle("chev")


class Moody(Stay):
    """Breaks the rule that an agent is a function of its seed."""

    calls = 0

    def act(self, state: object, tick: int) -> int:
        Moody.calls += 1
        return 4 if Moody.calls < 250 else 0


def tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, agent: type[Stay], layout: Layout = ROOM) -> str:
    loaded = bundle(tmp_path, linear_policy())
    monkeypatch.setattr(type(loaded), "make", lambda self: agent())
    return "\n".join(str(problem) for problem in problems_on(loaded, layout))


def test_agents_that_do_not_repeat_themselves_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "acts in another way the second time" in tried(tmp_path, monkeypatch, Moody)


def test_actions_that_are_none_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Wild(Stay):
        def act(self, state: object, tick: int) -> int:
            return 6 if tick == 3 else 4

    assert "on layout 'room' 6 is no action" in tried(tmp_path, monkeypatch, Wild)


def test_slow_agents_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = iter(range(10**6))
    monkeypatch.setattr("time.thread_time", lambda: 0.06 * next(ticks))
    assert "half of the first 50 took 60.0 ms or more, where 50 ms is the most" in tried(
        tmp_path, monkeypatch, Stay
    )
