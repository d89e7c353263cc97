"""Cells are played once, the same wherever they are played, and kept from one evaluation to the next."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from galley.agents.bundle import load_bundle
from galley.agents.episode import play_episodes
from galley.cli import app
from galley.errors import GalleyError
from galley.evaluation import crossplay
from galley.evaluation.agent_groups import AgentGroup
from galley.evaluation.crossplay import Roster, find_layouts, game_seeds, pairings, play_cells
from galley.evaluation.game_scores import GameScores, MeanScore
from galley.kitchen.layout_file import find_layout
from galley.workspace import Workspace

ROOT = Path(__file__).resolve().parents[2]
RING = "coordination_ring"
A, B, P = (AgentGroup(name, (name,)) for name in "abp")


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A workspace with two quick agents, one clone and two layouts of 60 ticks."""
    for name in ("random", "stay", "human-bc"):
        shutil.copytree(ROOT / "agents" / name, tmp_path / "agents" / name)
    (tmp_path / "layouts").mkdir()
    for name in ("cramped_room", RING):
        text = (ROOT / "layouts" / f"{name}.yaml").read_text("utf-8")
        path = tmp_path / "layouts" / f"{name}.yaml"
        path.write_text(text.replace("horizon_ticks: 400", "horizon_ticks: 60"), "utf-8")
    return tmp_path


def evaluate(home: Path, *arguments: str) -> Result:
    return CliRunner().invoke(app, ["learn", "evaluate", "--workspace", str(home), *arguments])


def scores(results: GameScores) -> dict[tuple[str, str, str], tuple[int, ...]]:
    return {cell.key: cell.scores for cell in results}


def test_everyone_plays_everyone_once_in_each_seat_order() -> None:
    assert pairings([A, B], None, itself=False) == [("a", "a"), ("a", "b"), ("b", "a"), ("b", "b")]
    assert pairings([A, B], [P], itself=False) == [("a", "p"), ("p", "a"), ("b", "p"), ("p", "b")]
    assert pairings([A], [P], itself=True) == [("a", "a"), ("a", "p"), ("p", "a")]
    assert pairings([A, P], [P], itself=False) == [("a", "p"), ("p", "a"), ("p", "p")]
    seeds = AgentGroup("seeds", ("a", "b"))
    assert pairings([seeds], None, itself=False) == [("a", "a"), ("b", "b")]
    assert len(pairings([seeds], [P], itself=True)) == 6


def test_layouts_are_those_that_all_know(home: Path) -> None:
    roster = Roster(home)
    with pytest.raises(GalleyError, match="no layout is named 'asymmetric_advantages'"):
        find_layouts(home, roster, ["human-bc"], [])
    assert [one.name for one in find_layouts(home, roster, ["stay"], ["simple", RING])] == [
        "cramped_room",
        RING,
    ]
    with pytest.raises(GalleyError, match="name one with --layout"):
        find_layouts(home, roster, ["stay", "random"], [])
    (home / "layouts" / "other.yaml").write_bytes((home / "layouts" / f"{RING}.yaml").read_bytes())
    with pytest.raises(GalleyError, match="agent human-bc does not know layout 'other'"):
        find_layouts(home, roster, ["stay", "human-bc"], ["other"])


def test_a_cell_is_the_same_alone_beside_others_and_on_other_processes(home: Path) -> None:
    layouts = [find_layout(Workspace(home), name) for name in ("cramped_room", RING)]
    pairs = [("human-bc", "random"), ("random", "human-bc"), ("human-bc", "human-bc")]
    alone, many = GameScores(), GameScores()
    for layout in reversed(layouts):
        for pair in pairs:
            play_cells(alone, [layout], [pair], workspace=home, games=6, seed=3)
    play_cells(many, layouts, pairs, workspace=home, games=6, seed=3, workers=2)
    assert len(many) == 6
    assert scores(many) == scores(alone)
    assert {cell.key: cell.fingerprint for cell in many} == {cell.key: cell.fingerprint for cell in alone}


def test_scores_are_those_of_the_bundles_and_more_games_begin_with_the_same(home: Path) -> None:
    layout = find_layout(Workspace(home), RING)
    results = GameScores()
    play_cells(results, [layout], [("human-bc", "stay")], workspace=home, games=4, seed=1)
    clone, stay = (load_bundle(home / "agents" / name, name) for name in ("human-bc", "stay"))
    seeds = game_seeds(1, (RING, "human-bc", "stay"), 9)
    assert seeds[:4] == game_seeds(1, (RING, "human-bc", "stay"), 4)
    assert len({*seeds, *game_seeds(2, (RING, "human-bc", "stay"), 9)}) == 18
    assert len({*seeds, *game_seeds(1, (RING, "stay", "human-bc"), 9)}) == 18
    assert results.cell(RING, "human-bc", "stay").scores == tuple(
        play_episodes(layout, (clone, stay), seeds[:4])
    )


def test_what_was_played_is_not_played_again_unless_something_changed(home: Path) -> None:
    layout = find_layout(Workspace(home), RING)
    results = GameScores()

    def cells(games: int = 3, seed: int = 1) -> int:
        started: list[int] = []
        pairs = [("human-bc", "stay")]
        play_cells(results, [layout], pairs, workspace=home, games=games, seed=seed, on_start=started.append)
        return started[0]

    assert cells() == 1
    assert cells() == cells(games=2) == 0
    (home / "agents" / "human-bc" / "card.md").write_text("scores", "utf-8")
    assert cells() == 0
    assert cells(games=5) == 1
    assert len(results.cell(RING, "human-bc", "stay").scores) == 5
    with pytest.raises(GalleyError, match=r"hold games of seed 1, .* use --seed 1, or another file"):
        cells(seed=2)
    assert len(results.cell(RING, "human-bc", "stay").scores) == 5
    described = home / "agents" / "human-bc" / "agent.yaml"
    described.write_text(
        described.read_text("utf-8").replace("sampling: sample", "sampling: argmax"), "utf-8"
    )
    assert cells() == 1
    shutil.copy(
        home / "agents" / "human-bc" / "cramped_room.onnx", home / "agents" / "human-bc" / f"{RING}.onnx"
    )
    assert cells() == 1
    layout = layout.with_rules(horizon_ticks=61)
    with pytest.raises(GalleyError, match="give every worker the same workspace"):
        cells()


def test_results_come_back_from_their_file(home: Path) -> None:
    out, table = home / "out" / "results.json", home / "out" / "results.csv"
    done = evaluate(
        home, "random", "stay", "--layout", RING, "--games", "3", "--out", str(out), "--csv", str(table)
    )
    assert done.exit_code == 0, done.output
    assert "3 games for each seat order, seed 0" in done.stdout
    results = GameScores.load(out)
    assert results.layouts == [RING]
    assert len(results) == 4
    assert all(len(cell.scores) == 3 for cell in results)
    with table.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["seat_0"], row["seat_1"], row["games"]) for row in rows] == [
        ("random", "random", "3"),
        ("random", "stay", "3"),
        ("stay", "random", "3"),
        ("stay", "stay", "3"),
    ]
    again = GameScores(results)
    again.save(home / "again.json")
    assert (home / "again.json").read_bytes() == out.read_bytes()


def test_a_second_evaluation_only_plays_what_is_new(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = home / "results.json"
    common = ["--layout", RING, "--games", "2", "--out", str(out)]
    assert evaluate(home, "stay", *common).exit_code == 0
    tried: list[object] = []
    once = crossplay._play

    def counted(task: crossplay.Task, workspace: str, games: int, seed: int) -> object:
        tried.append(task.seats)
        return once(task, workspace, games, seed)

    monkeypatch.setattr(crossplay, "_play", counted)
    done = evaluate(home, "stay", "random", *common, "--json")
    assert sorted(tried) == [("random", "random"), ("random", "stay"), ("stay", "random")]
    rows = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    assert [(row["agent"], row["partner"]) for row in rows] == [
        ("stay", "itself"),
        ("stay", "random"),
        ("stay", "others"),
        ("random", "stay"),
        ("random", "itself"),
        ("random", "others"),
    ]


def test_bundles_outside_the_workspace_play_like_those_within(home: Path, tmp_path: Path) -> None:
    folder = home / "runs" / "human-bc"
    shutil.copytree(home / "agents" / "human-bc", folder)
    layout = find_layout(Workspace(home), RING)
    results = GameScores()
    pairs = [(str(folder), "random"), ("human-bc", "random")]
    play_cells(results, [layout], pairs, workspace=home, games=3, seed=0)
    assert results.cell(RING, str(folder), "random").scores == results.cell(RING, "human-bc", "random").scores


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["nobody", "--layout", RING], "nobody"),
        (["./nowhere", "--layout", RING], "no such folder; name an agent or the folder of a bundle"),
        (["stay", "--layout", "ringg"], "no layout is named 'ringg'"),
        (["stay", "x=stay,random", "x=random", "--layout", RING], "x: named twice"),
    ],
)
def test_mistakes_are_told_before_anything_is_played(home: Path, arguments: list[str], told: str) -> None:
    done = evaluate(home, *arguments, "--out", str(home / "out.json"))
    assert isinstance(done.exception, GalleyError)
    assert told in str(done.exception)
    assert not (home / "out.json").exists()


def test_a_file_of_something_else_is_refused_and_left_alone(home: Path) -> None:
    out = home / "results.json"
    out.write_text('{"format": 1, "cells": [{"layout": "room"}]}', "utf-8")
    done = evaluate(home, "stay", "--layout", RING, "--games", "1", "--out", str(out))
    assert isinstance(done.exception, GalleyError)
    assert "holds no results of galley learn evaluate (cells.0.seat_0" in str(done.exception)
    assert "room" in out.read_text("utf-8")
    with pytest.raises(GalleyError, match="cannot be read"):
        GameScores.load(home / "none.json")


def test_mean_and_standard_error() -> None:
    result = MeanScore.of((0, 20, 40, 60))
    assert result.mean == 30
    assert result.standard_error == pytest.approx(np.sqrt(2000 / 3 / 4))
    assert MeanScore.of([20]).standard_error == 0
