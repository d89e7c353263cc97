"""Figures show the numbers that they are drawn from."""

from __future__ import annotations

import csv
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.image import AxesImage
from matplotlib.patches import FancyArrowPatch
from typer.testing import CliRunner, Result

from galley.cli import app
from galley.errors import GalleyError
from galley.evaluation.agent_groups import AgentGroup
from galley.evaluation.game_graph import PayoffTable, centrality_matrix
from galley.evaluation.game_scores import Cell, GameScores
from galley.learning.plots.bars import draw_bars
from galley.learning.plots.curves import draw_curves, read_curve, smoothed
from galley.learning.plots.graphs import draw_graphs, spread
from galley.learning.plots.matrices import draw_matrices
from galley.learning.plots.sources import read_payoffs
from galley.plot_style import COLOURS, DARK_GREY, GREY, save, titled

A, B, P = (AgentGroup(name, (name,)) for name in ("a", "b", "p"))
SCORES = {
    ("a", "a"): (100, 100),
    ("a", "p"): (0, 40),
    ("p", "a"): (60, 60),
    ("b", "b"): (20, 20),
    ("b", "p"): (40, 40),
    ("p", "b"): (120, 120),
    ("a", "b"): (20, 20),
    ("b", "a"): (40, 40),
    ("p", "p"): (0, 0),
}
PAYOFFS = [[10, 60, 30, 40], [60, 20, 50, 20], [30, 50, 90, 10], [40, 20, 10, 99]]


def results(*layouts: str) -> GameScores:
    return GameScores(
        Cell(layout=layout, seat_0=one, seat_1=other, seed=0, fingerprint="f", scores=scores)
        for layout in layouts
        for (one, other), scores in SCORES.items()
    )


def table(payoffs: list[list[int]] = PAYOFFS) -> PayoffTable:
    made = PayoffTable(f"s{number}" for number in range(len(payoffs)))
    for seat_0, seat_1 in made.missing():
        made.set(seat_0, seat_1, payoffs[seat_0][seat_1])
    return made


def log(
    path: Path, ticks: list[object], scores: list[object], header: str = "ticks,generation,score"
) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(header.split(","))
        writer.writerows([tick, 0, score] for tick, score in zip(ticks, scores, strict=True))
    return path


def plot(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["learn", "plot", *arguments])


def test_bars_are_the_means_by_seat_with_their_errors() -> None:
    figure = draw_bars(results("cramped_room", "ring"), ["cramped_room", "ring"], [A, B], P, itself=True)
    (axes,) = figure.axes
    bars = [bar for bar in axes.patches if to_hex(bar.get_facecolor()) != GREY.lower()]
    # By layout and agent: on seat 0, then on seat 1.
    assert [bar.get_height() for bar in bars] == [20, 60, 40, 120] * 2
    assert [to_hex(bar.get_facecolor()) for bar in bars[:4]] == [
        COLOURS[place].lower() for place in (0, 0, 1, 1)
    ]
    assert [bar.get_hatch() is not None for bar in bars[:4]] == [False, True, False, True]
    grey = [bar for bar in axes.patches if to_hex(bar.get_facecolor()) == GREY.lower()]
    assert [bar.get_height() for bar in grey] == [100, 20] * 2
    levels = [line.get_ydata() for line in axes.lines if line.get_color() == DARK_GREY]
    assert [level[0] for level in levels] == [100, 20] * 2
    ends = [segment for container in axes.collections for segment in container.get_segments()]
    assert ends[0][:, 1].tolist() == pytest.approx([0, 40])  # 20 with an error of 20
    assert [label.get_text() for label in axes.get_xticklabels()] == ["Cramped Room", "Ring"]
    assert titled("COLE 1:3") == "COLE 1:3"


def test_bars_without_self_play_need_no_games_with_itself() -> None:
    few = GameScores(cell for cell in results("ring") if cell.seat_0 != cell.seat_1)
    (axes,) = draw_bars(few, ["ring"], [A, B], P, itself=False).axes
    assert len(axes.patches) == 4
    with pytest.raises(GalleyError, match="a on seat 0 was not played with a on seat 1"):
        draw_bars(few, ["ring"], [A, B], P, itself=True)


def test_squares_hold_payoffs_and_centralities() -> None:
    figure = draw_matrices([("COLE", table()), ("MEP", table([[0, 0], [0, 0]]))])
    left, right, left_below, right_below = figure.axes[:4]
    images = [axes.images[0] for axes in (left, right, left_below, right_below)]
    assert all(isinstance(image, AxesImage) for image in images)
    np.testing.assert_array_equal(images[0].get_array(), PAYOFFS)
    centralities = centrality_matrix(np.array(PAYOFFS, dtype=float))
    np.testing.assert_array_equal(np.ma.filled(images[1].get_array(), np.nan), centralities)
    assert images[0].get_clim() == images[2].get_clim() == (0, 99)
    assert left.get_title() == "COLE"
    assert right.get_title() == "Mean of the newest: 0.67"  # 0, 1 and 1
    assert right_below.get_title() == "Mean of the newest: 0.00"
    assert [text.get_text() for text in right.texts][:3] == ["0.00", "0.00", "0.00"]
    assert [label.get_text() for label in left.get_yticklabels()] == ["s0", "s1", "s2", "s3"]


def test_large_squares_are_numbered_from_one_and_hold_no_text() -> None:
    size = 50
    rows = [[one * other for other in range(size)] for one in range(size)]
    left = draw_matrices([("run", table(rows))]).axes[0]
    assert not left.texts
    assert [label.get_text() for label in left.get_yticklabels()] == ["1", "10", "20", "30", "40", "50"]
    assert left.get_yticks().tolist() == [0, 9, 19, 29, 39, 49]


def test_graphs_show_who_prefers_whom_at_each_step() -> None:
    figure = draw_graphs(table())
    game, *steps = figure.axes[:4]
    assert [axes.get_title() for axes in (game, *steps)] == [
        "Game graph",
        "Preferences among 2",
        "Preferences among 3",
        "Preferences among 4",
    ]
    arrows = [[patch for patch in axes.patches if isinstance(patch, FancyArrowPatch)] for axes in steps]
    assert [len(found) for found in arrows] == [2, 3, 4]
    written = {text.get_text() for text in game.texts}
    assert written == {"1", "2", "3", "4", "60", "30", "40", "50", "20", "10"}
    (nodes,) = (found for found in steps[2].collections if len(found.get_offsets()) == 4)
    widths = nodes.get_linewidths()
    assert widths[3] > widths[0] == widths[1] == widths[2]


def test_steps_are_spread_or_chosen() -> None:
    assert spread(50) == [2, 18, 34, 50]
    assert spread(2) == [2]
    assert spread(4) == [2, 3, 4]
    titles = [axes.get_title() for axes in draw_graphs(table(), [3, 4]).axes]
    assert titles[:3] == ["Game graph", "Preferences among 3", "Preferences among 4"]
    assert len(draw_graphs(table(), [2, 3, 4, 2, 3, 4]).axes) >= 7
    with pytest.raises(GalleyError, match="step 5 is not from 2 to 4"):
        draw_graphs(table(), [5])
    with pytest.raises(GalleyError, match="at least two strategies"):
        draw_graphs(table([[1]]))
    assert draw_graphs(table([[0, 0], [0, 0]])).axes


def test_logs_of_earlier_versions_are_drawn_under_either_name(tmp_path: Path) -> None:
    (tmp_path / "old.csv").write_text("ticks,clipped,divergence\n1,0.5,0.25\n")
    (tmp_path / "new.csv").write_text("ticks,clip_fraction,approx_kl\n1,0.5,0.25\n")
    for file in (tmp_path / "old.csv", tmp_path / "new.csv"):
        for column, value in (
            ("clipped", 0.5),
            ("clip_fraction", 0.5),
            ("divergence", 0.25),
            ("approx_kl", 0.25),
        ):
            assert read_curve(file, column).values.tolist() == [value]


def test_a_curve_is_the_column_of_the_log(tmp_path: Path) -> None:
    ticks, scores = [100, 200, 300, 200, 400, "x"], [1, "", 5, 3, float("nan"), 9]
    log(tmp_path / "run" / "log.csv", ticks, scores)
    curve = read_curve(tmp_path / "run", "score")
    # The second row of 200 ticks is the one that went on; rows without numbers are left out.
    assert curve.ticks.tolist() == [100, 200, 300]
    assert curve.values.tolist() == [1, 3, 5]
    (axes,) = draw_curves([AgentGroup("run", (str(tmp_path / "run"),))], ["score"]).axes
    (line,) = axes.lines
    assert line.get_xydata().tolist() == [[100, 1], [200, 3], [300, 5]]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("ticks", "score")


def test_several_runs_are_their_mean_in_a_band_where_all_have_values(tmp_path: Path) -> None:
    one = log(tmp_path / "one.csv", [0, 100, 200], [0, 10, 20])
    other = log(tmp_path / "other.csv", [50, 150], [25, 35])
    figure = draw_curves([AgentGroup("both", (str(one), str(other)))], ["score", "generation"])
    axes = figure.axes[0]
    (line,) = axes.lines
    found = line.get_xydata()
    # From 50 to 150 ticks the first goes from 5 to 15 and the second from 25 to 35: mean 15 to 25, error 10.
    assert found[0].tolist() == [50, 15]
    assert found[-1].tolist() == [150, 25]
    band = axes.collections[0].get_paths()[0].vertices
    assert band[:, 1].min() == pytest.approx(5)
    assert band[:, 1].max() == pytest.approx(35)
    assert len(figure.axes) == 2
    apart = log(tmp_path / "apart.csv", [500, 600], [0, 1])
    with pytest.raises(GalleyError, match="both: its runs share no ticks"):
        draw_curves([AgentGroup("both", (str(one), str(apart)))], ["score"])


def test_smoothing_looks_back_only() -> None:
    assert smoothed(np.array([2.0, 4.0, 9.0, 5.0]), 3).tolist() == [2, 3, 5, 6]
    assert smoothed(np.array([2.0, 4.0]), 1).tolist() == [2, 4]


def test_logs_that_cannot_be_drawn_are_told(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv", [1], [""])
    with pytest.raises(GalleyError, match="column 'score' holds no number"):
        read_curve(path, "score")
    with pytest.raises(GalleyError, match="no column 'scores'; did you mean 'score'"):
        read_curve(path, "scores")
    with pytest.raises(GalleyError, match="none: cannot be read"):
        read_curve(tmp_path / "none", "score")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00ticks")
    with pytest.raises(GalleyError, match="is no CSV log"):
        read_curve(tmp_path / "bytes.csv", "score")


def test_payoffs_come_from_runs_and_from_evaluations(tmp_path: Path) -> None:
    table().save(tmp_path / "payoffs.npz")
    assert read_payoffs(tmp_path / "payoffs.npz").payoffs().tolist() == PAYOFFS
    some = read_payoffs(tmp_path / "payoffs.npz", agents=["s3", "s0"])
    assert some.names == ["s3", "s0"]
    assert some.payoffs().tolist() == [[99, 40], [40, 10]]
    results("ring", "room").save(tmp_path / "r.json")
    with pytest.raises(GalleyError, match="holds ring, room; name one with --layout"):
        read_payoffs(tmp_path / "r.json")
    played = read_payoffs(tmp_path / "r.json", layout="room")
    assert played.names == ["a", "p", "b"]
    assert played.payoffs()[0].tolist() == [100, 40, 30]
    assert read_payoffs(tmp_path / "r.json", "room", ["b", "a"]).payoffs().tolist() == [[20, 30], [30, 100]]
    for path, agents, told in (
        ("payoffs.npz", ["s9"], "holds no s9; it holds s0, s1, s2, s3"),
        ("r.json", ["a", "z"], "3 cells are missing"),
    ):
        with pytest.raises(GalleyError, match=told):
            read_payoffs(tmp_path / path, "room", agents)
    PayoffTable().save(tmp_path / "empty.npz")
    with pytest.raises(GalleyError, match="it is empty"):
        read_payoffs(tmp_path / "empty.npz")


def test_the_same_figure_gives_the_same_file_in_every_format(tmp_path: Path) -> None:
    heads = {"svg": b"<?xml", "pdf": b"%PDF-", "png": b"\x89PNG\r"}
    for ending, head in heads.items():
        for name in ("one", "two"):
            save(draw_graphs(table()), tmp_path / f"{name}.{ending}")
        content = (tmp_path / f"one.{ending}").read_bytes()
        assert content.startswith(head)
        assert content == (tmp_path / f"two.{ending}").read_bytes()
    ElementTree.parse(tmp_path / "one.svg")
    with pytest.raises(GalleyError, match=r"must end in one of \.svg \.pdf \.png"):
        save(draw_graphs(table()), tmp_path / "one.jpg")


def test_every_command_draws(tmp_path: Path) -> None:
    table().save(tmp_path / "p.npz")
    results("ring", "room").save(tmp_path / "r.json")
    log(tmp_path / "run" / "log.csv", [1, 2], [3, 4])
    out = tmp_path / "figures" / "f.svg"
    for arguments in (
        ["bars", str(tmp_path / "r.json"), "--partner", "p", "--itself"],
        ["bars", str(tmp_path / "r.json"), "--partner", "H=p", "--agent", "x=a,b", "--layout", "room"],
        ["matrices", f"COLE={tmp_path / 'p.npz'}", str(tmp_path / "r.json"), "--layout", "room"],
        ["graphs", str(tmp_path / "p.npz"), "--step", "3"],
        ["curves", str(tmp_path / "run"), "--column", "score", "--column", "generation"],
    ):
        done = plot(*arguments, "--out", str(out))
        assert done.exit_code == 0, done.output or done.exception
        assert out.read_bytes().startswith(b"<?xml")
        out.unlink()
    done = plot("matrices", f"COLE={tmp_path / 'p.npz'}", "--out", str(out))
    assert done.stdout == "COLE: mean preference centrality of 3 newest 0.667\n"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["curves", "run", "--out", "f.gif"], "must end in one of"),
        (["bars", "none.json", "--partner", "p", "--out", "f.svg"], "cannot be read"),
        (["matrices", "none.npz", "--out", "f.svg"], "cannot be read"),
        (["graphs", "none.npz", "--out", "f.svg"], "cannot be read"),
        (["curves", "none", "--out", "f.svg"], "cannot be read"),
    ],
)
def test_mistakes_are_told_in_one_line(arguments: list[str], told: str) -> None:
    done = plot(*arguments)
    assert isinstance(done.exception, GalleyError)
    assert told in str(done.exception)


def test_bars_of_a_partner_that_nobody_played_are_refused(tmp_path: Path) -> None:
    results("ring").save(tmp_path / "r.json")
    done = plot("bars", str(tmp_path / "r.json"), "--partner", "q", "--out", str(tmp_path / "f.svg"))
    assert isinstance(done.exception, GalleyError)
    assert "nobody was played with q" in str(done.exception)
