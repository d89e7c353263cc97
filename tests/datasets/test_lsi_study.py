"""Games in the format of the LSI user study: written here, read back, compared figure by figure."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from galley.datasets.lsi_study import COLUMNS, RULES, read_games
from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.kitchen.measures import measures
from galley.kitchen.reach import STEPS
from galley.kitchen.trajectory import Trajectory
from galley.planning.trials import run

GRID = ("XXXPXXX", "O  1  O", "X     X", "X 2   X", "XDXXSXX")


def played(seed: int) -> Trajectory:
    layout = Layout(f"even_workloads-{seed}", GRID, RULES)
    trials = run(layout, "qmdp", 0.1, np.array([seed], dtype=np.uint64))
    return Trajectory(layout, trials.joint_actions[0, : trials.ticks[0]])


def row(trajectory: Trajectory) -> dict[str, str]:
    found = measures(trajectory)
    names = ("num_ingre_held", "num_plate_held", "num_served")
    loads = [
        dict(zip(names, (found.ingredients[s], found.dishes[s], found.served[s]), strict=True))
        for s in (0, 1)
    ]
    words = [*STEPS, (0, 0), "interact"]
    actions = [(words[one], words[other]) for one, other in trajectory.joint_actions.tolist()]
    told = (
        trajectory.layout.name, str(loads), str(found.ticks), str(found.concurrent_ticks),
        str(found.stuck_ticks), str(actions), "\n".join(GRID) + "\n",
    )  # fmt: skip
    return dict(zip(COLUMNS, told, strict=True))


def write(path: Path, rows: list[dict[str, str]]) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    return path


def test_games_written_in_the_format_are_as_recorded(tmp_path: Path) -> None:
    trajectories = [played(seed) for seed in range(4)]
    games = read_games(write(tmp_path / "p.csv", [row(one) for one in trajectories]))
    assert [game.name for game in games] == [f"even_workloads-{seed}" for seed in range(4)]
    for game, trajectory in zip(games, trajectories, strict=True):
        assert game.differences() == ()
        assert np.array_equal(game.trajectory.joint_actions, trajectory.joint_actions)
        assert game.recorded.orders == 2


def test_each_difference_is_told(tmp_path: Path) -> None:
    wrong = row(played(1))
    wrong["stuck_time"] = str(int(wrong["stuck_time"]) + 1)
    wrong["total_time_step"] = "150"
    told = read_games(write(tmp_path / "p.csv", [wrong]))[0].differences()
    assert [one.split(":")[0] for one in told] == ["ticks", "stuck_ticks"]


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("joint_actions", "[((0, 2), (0, 1))]", "no action"),
        ("joint_actions", "__import__('os')", "cannot be read"),
        ("joint_actions", "[1, 2]", "no list of pairs"),
        ("workloads", "[{}]", "two chefs"),
        ("workloads", "[{}, {}]", "num_ingre_held"),
        ("stuck_time", "-", "not a whole number"),
        ("lvl_str", "XX\nXX", "chef 1 is missing"),
    ],
)
def test_a_line_that_is_no_game_is_refused_with_its_place(
    tmp_path: Path, column: str, value: str, message: str
) -> None:
    good, bad = row(played(0)), row(played(0))
    bad[column] = value
    with pytest.raises(GalleyError, match=message) as error:
        read_games(write(tmp_path / "p.csv", [good, bad]))
    assert str(error.value).startswith(f"{tmp_path / 'p.csv'}:8: ")


def test_a_file_without_the_columns_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.csv"
    path.write_text("a,b\n1,2\n", encoding="utf-8")
    with pytest.raises(GalleyError, match="column lvl_type is missing"):
        read_games(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(GalleyError, match="not a text file"):
        read_games(path)
