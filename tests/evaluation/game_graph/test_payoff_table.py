"""Payoffs are completed cell by cell, shrink and grow with the population, and survive a checkpoint."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from galley.errors import GalleyError
from galley.evaluation.game_graph import Cell, PayoffTable
from galley.evaluation.game_graph.payoff_table import require_payoffs


def full(names: str) -> PayoffTable:
    """Every cell filled: 10 times the strategy on seat 0 plus the one on seat 1."""
    table = PayoffTable(names)
    for seat_0, seat_1 in table.missing():
        table.set(seat_0, seat_1, 10 * seat_0 + seat_1, standard_error=seat_0, games=1 + seat_1)
    return table


def test_only_cells_that_were_never_played_are_missing() -> None:
    table = PayoffTable(["a", "b"])
    assert table.missing() == [(0, 0), (0, 1), (1, 0), (1, 1)]
    table.set(0, 1, 40.0, standard_error=2.0, games=50)
    assert table.missing() == [(0, 0), (1, 0), (1, 1)]
    assert table.cell(0, 1) == Cell(40.0, 2.0, 50)
    assert table.cell(1, 0) is None
    for cell in table.missing():
        table.set(*cell, 20.0)
    assert table.missing() == []
    assert table.add("c") == 2
    assert table.missing() == [(0, 2), (1, 2), (2, 0), (2, 1), (2, 2)]


def test_a_payoff_is_the_mean_of_both_seat_orders_whatever_their_games() -> None:
    table = PayoffTable(["a", "b"])
    table.set(0, 0, 100.0)
    table.set(0, 1, 30.0, games=1000)
    table.set(1, 1, 0.0)
    assert np.isnan(table.payoffs()[[0, 1], [1, 0]]).all()
    table.set(1, 0, 70.0, games=1)
    assert table.payoffs().tolist() == [[100.0, 50.0], [50.0, 0.0]]


def test_a_strategy_leaves_with_its_row_and_column() -> None:
    table = full("abc")
    assert table.remove(1) == "b"
    assert table.names == ["a", "c"]
    assert table.mean.tolist() == [[0, 2], [20, 22]]
    assert table.standard_error.tolist() == [[0, 0], [2, 2]]
    assert table.games.tolist() == [[1, 3], [1, 3]]
    assert len(table) == 2
    assert table.missing() == []
    assert table.add("b") == 2


def test_a_saved_table_comes_back_as_it_was(tmp_path: Path) -> None:
    table = full("abc")
    table.add("étape 4")
    table.save(tmp_path / "runs" / "payoffs.npz")
    again = PayoffTable.load(tmp_path / "runs" / "payoffs.npz")
    assert again.names == ["a", "b", "c", "étape 4"]
    for part, array in table.arrays().items():
        np.testing.assert_array_equal(again.arrays()[part], array)
    assert again.missing() == table.missing()
    again.set(3, 3, 1.0)
    assert [path.name for path in (tmp_path / "runs").iterdir()] == ["payoffs.npz"]
    empty = PayoffTable.from_arrays(PayoffTable().arrays())
    assert len(empty) == 0


def test_a_file_that_is_no_table_is_told(tmp_path: Path) -> None:
    with pytest.raises(GalleyError, match=r"nowhere\.npz: cannot be read"):
        PayoffTable.load(tmp_path / "nowhere.npz")
    (tmp_path / "text.npz").write_text("payoffs", "utf-8")
    with pytest.raises(GalleyError, match=r"text\.npz: holds no table"):
        PayoffTable.load(tmp_path / "text.npz")
    np.savez(tmp_path / "other.npz", names=np.array(["a"]))
    with pytest.raises(GalleyError, match="mean, standard_error, games lacks"):
        PayoffTable.load(tmp_path / "other.npz")
    parts = full("ab").arrays() | {"mean": np.zeros((3, 3))}
    with pytest.raises(ValueError, match=r"mean has shape \[3, 3\], not \[2, 2\]"):
        PayoffTable.from_arrays(parts)


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        ((0, 2, 1.0, 0.0, 1), "strategy 2 is none of the 2"),
        ((0, -1, 1.0, 0.0, 1), "strategy -1"),
        ((0, 1, -1.0, 0.0, 1), "finite number from 0 up"),
        ((0, 1, float("nan"), 0.0, 1), "finite number from 0 up"),
        ((0, 1, 1.0, float("nan"), 1), "finite number from 0 up"),
        ((0, 1, 1.0, 0.0, 0), "at least one game"),
    ],
)
def test_wrong_cells_are_refused_and_change_nothing(
    cell: tuple[int, int, float, float, int], told: str
) -> None:
    table = PayoffTable("ab")
    with pytest.raises(ValueError, match=told):
        table.set(*cell)
    assert len(table.missing()) == 4
    with pytest.raises(ValueError, match="'a' is in the table already"):
        table.add("a")


@pytest.mark.parametrize(
    ("payoffs", "told"),
    [
        (np.zeros((2, 3)), "shape"),
        (np.zeros((0, 0)), "shape"),
        (np.array([[1.0, np.nan], [np.nan, 1.0]]), "not complete: 2 cells"),
        (np.array([[1.0, -2.0], [-2.0, 1.0]]), "negative; the least is -2"),
    ],
)
def test_payoffs_that_no_graph_can_have_are_refused(payoffs: np.ndarray, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        require_payoffs(payoffs)
