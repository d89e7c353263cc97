"""CSV in the field's public schema: what we export is read back, replayed and compared."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from galley.agents.episode import play_episode
from galley.datasets.field_games import field_games
from galley.datasets.field_states import ACTIONS_THERE, state_here, state_there
from galley.datasets.kinds_of_files import csv_kind
from galley.datasets.overcooked_games import import_files
from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.kitchen.state import from_view, view
from galley.kitchen.trajectory import play
from galley.planning.myopic import Myopic
from tests.serving import run_galley

KITCHENS = {
    "any soup": Layout.from_ascii(
        "own", "XXPPXX\nO 1  T\nX  2 X\nXDXXSX", cook_time_ticks=3, horizon_ticks=300
    ),
    "orders": Layout.from_ascii(
        "own",
        "XXPPXX\nO 1  T\nX  2 X\nXDXXSX",
        cook_time_ticks=3,
        horizon_ticks=300,
        delivery_reward=7,
        orders=("tomato", "onion", "onion", "tomato"),
    ),
}


def written(path: Path, layout: Layout, seed: int, ticks: int = 250) -> int:
    """A game of two myopic chefs, as the export writes it; how many soups paid."""
    actions = play_episode(layout, (Myopic(0.2), Myopic(0.2)), seed, ticks).joint_actions
    episode = play(layout, actions)
    names = ("state", "joint_action", "reward", "cur_gameloop", "layout", "layout_name", "trial_id")
    rows = []
    for tick in range(episode.ticks):
        rows.append(
            {
                "state": json.dumps(state_there(layout, view(layout, episode.states[tick]))),
                "joint_action": json.dumps([ACTIONS_THERE[action] for action in actions[tick].tolist()]),
                "reward": int(episode.out[tick, 0]),
                "cur_gameloop": tick,
                "layout": json.dumps([list(row.replace("1", " ").replace("2", " ")) for row in layout.grid]),
                "layout_name": layout.name,
                "trial_id": str(seed),
            }
        )
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)
    return int((episode.out[:, 0] > 0).sum())


@pytest.mark.parametrize("name", KITCHENS)
def test_f10_games_as_we_write_them_are_retold_to_the_last_transition(tmp_path: Path, name: str) -> None:
    paid = [written(tmp_path / f"{seed}.csv", KITCHENS[name], seed) for seed in range(12)]
    assert sum(paid) > 0
    report = import_files(sorted(tmp_path.glob("*.csv")), field_games)
    assert (report.games, report.mismatched, report.replayed) == (12, 0, 12)
    assert report.transitions > 1000


def test_f10_every_state_is_read_as_it_was_written() -> None:
    layout = KITCHENS["any soup"]
    actions = np.random.default_rng(5).integers(0, 6, (300, 2)).astype(np.uint8)
    for state in play(layout, actions).states:
        seen = view(layout, state)
        again = from_view(layout, state_here(layout, state_there(layout, seen)))
        assert view(layout, again).pots == seen.pots
        assert (view(layout, again).chefs, view(layout, again).things) == (seen.chefs, seen.things)


def test_f10_a_changed_record_is_found(tmp_path: Path) -> None:
    path = tmp_path / "game.csv"
    written(path, KITCHENS["any soup"], 3)
    lines = path.read_text("utf-8").splitlines()
    lines[40] = lines[40].replace(",0,", ",7,", 1)
    path.write_text("\n".join(lines) + "\n", "utf-8")
    report = import_files([path], field_games)
    assert report.mismatched >= 1
    assert report.first_mismatch.startswith(f"{path}: game 0, own, tick ")


def test_f10_the_command_knows_the_kinds_and_tells_all_problems(tmp_path: Path) -> None:
    written(tmp_path / "good.csv", KITCHENS["any soup"], 1)
    (tmp_path / "half.csv").write_text("state,joint_action\n1,2\n", "utf-8")
    (tmp_path / "other.csv").write_text("a,b\n1,2\n", "utf-8")
    (tmp_path / "empty.csv").write_text("", "utf-8")
    (tmp_path / "broken.pickle").write_bytes(b"no")
    names = [f"{name}.csv" for name in ("good", "half", "other", "empty", "missing")]
    done = run_galley("trajectories", "import", *names, "broken.pickle", cwd=tmp_path)
    assert done.returncode == 1
    assert "games=1" in done.stdout
    assert "mismatched=0" in done.stdout
    told = done.stderr.splitlines()
    assert len(told) == 5
    assert any(line.startswith("half.csv:1: the column reward is missing") for line in told)
    assert any(line.startswith("other.csv:1: none of its columns is known here") for line in told)
    assert any(line.startswith("missing.csv: cannot be read") for line in told)
    assert any(line.startswith("broken.pickle: not a whole pickle") for line in told)


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("state", "{"),
        ("state", "[" * 5000),
        ("state", "{}"),
        ("joint_action", '[[0, 0], "fly"]'),
        ("joint_action", "[[0, 0]]"),
        ("reward", "many"),
        ("layout", '[["X"]]'),
        ("cur_gameloop", "x"),
    ],
)
def test_f10_what_is_no_game_is_told_with_its_line(tmp_path: Path, column: str, value: str) -> None:
    path = tmp_path / "game.csv"
    written(path, KITCHENS["any soup"], 1)
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    rows[0][column] = value
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    with pytest.raises(GalleyError, match=r":2: the game that begins here cannot be read \(") as caught:
        field_games(path)
    assert "\n" not in str(caught.value)


def test_kinds_are_told_by_columns(tmp_path: Path) -> None:
    written(tmp_path / "field.csv", KITCHENS["any soup"], 1, ticks=5)
    assert csv_kind(tmp_path / "field.csv") == "field"
    (tmp_path / "study.csv").write_text("lvl_type,workloads,joint_actions\n", "utf-8")
    assert csv_kind(tmp_path / "study.csv") == "study"
