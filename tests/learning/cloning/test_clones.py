"""The whole way from human games to a bundle that plays, on made-up games."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import galley.learning.cloning.clones as bc
from galley.agents.catalogue import Catalogue
from galley.datasets.overcooked_games import HumanGame
from galley.errors import GalleyError
from galley.kitchen import Kitchen
from galley.kitchen.layout_file import find_layout
from galley.workspace import Workspace

ROOT = Path(__file__).resolve().parents[3]


def made_up_games(workspace: Workspace) -> list[HumanGame]:
    """One short game of random actions on each layout."""
    games = []
    rng = np.random.default_rng(0)
    for name in bc.EPOCHS:
        kitchen = Kitchen(find_layout(workspace, name))
        actions = rng.integers(0, 6, size=(60, 2)).astype(np.uint8)
        states = [kitchen.state.copy()]
        rewards = []
        for joint in actions:
            rewards.append(kitchen.step(*joint.tolist()))
            states.append(kitchen.state.copy())
        stacked = np.array(states)
        games.append(
            HumanGame(
                kitchen.layout, stacked[:-1], actions, stacked[1:], np.array(rewards, np.int32), "made-up"
            )
        )
    return games


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    shutil.copytree(ROOT / "layouts", tmp_path / "layouts")
    return Workspace(tmp_path)


def test_games_become_a_bundle_that_plays(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bc, "human_games", lambda path: made_up_games(workspace))
    monkeypatch.setattr(bc, "EPOCHS", dict.fromkeys(bc.EPOCHS, 1))
    data = workspace.path / ".cache" / "overcooked-ai" / "deep"
    data.mkdir(parents=True)
    (data / "clean_test_trials.pickle").write_bytes(b"read by the function put in place")
    told: list[str] = []
    rows = bc.learn_bc(workspace.path, split="test", seed=3, games=2, tell=told.append)
    bundle = Catalogue(workspace).bundle("human-proxy")
    assert [row.layout for row in rows] == list(bundle.layouts or ())
    assert all(row.rows == 120 for row in rows)
    assert len(told) == 10
    assert Catalogue(workspace).check() == []
    card = (bundle.path / "card.md").read_text("utf-8")
    assert "measuring stick" in card
    assert "--split test --seed 3 --games 2" in card
    assert f"| cramped_room | 120 | 1 | {rows[0].train_accuracy:.3f} |" in card
    out = workspace.path / "again" / "human-proxy"
    bc.learn_bc(workspace.path, split="test", seed=3, games=2, out=out)
    for path in sorted(bundle.path.iterdir()):
        assert path.read_bytes() == (out / path.name).read_bytes()


def test_rows_are_what_each_seat_saw_and_did(workspace: Workspace) -> None:
    games = made_up_games(workspace)[:1]
    layout = games[0].layout
    observations, actions = bc.cloning_rows(layout, games * 2)
    assert observations.shape == (240, 62)
    assert actions[:60].tolist() == games[0].joint_actions[:, 0].tolist()
    assert actions[60:120].tolist() == games[0].joint_actions[:, 1].tolist()
    seat_1 = bc.Encoder(layout, bc.ENCODING).seat(games[0].states, 1)
    assert np.array_equal(observations[60:120], seat_1)


def test_missing_data_is_told(workspace: Workspace) -> None:
    with pytest.raises(GalleyError, match=r"holds 0 files clean_train_trials\.pickle; name the folder"):
        bc.learn_bc(workspace.path, data=workspace.path, split="train")


def test_missing_layouts_are_told(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bc, "human_games", lambda path: made_up_games(workspace)[1:])
    data = workspace.path / "clean_train_trials.pickle"
    data.write_bytes(b"")
    with pytest.raises(GalleyError, match="holds no game on cramped_room"):
        bc.learn_bc(workspace.path, data=data, split="train")
