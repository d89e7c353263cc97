"""Payoff tables from what runs and evaluations leave behind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from galley.errors import GalleyError
from galley.evaluation.game_graph import PayoffTable
from galley.evaluation.game_scores import GameScores


def read_payoffs(path: Path, layout: str | None = None, agents: Sequence[str] = ()) -> PayoffTable:
    """The complete table in `path`: `.npz` of a run, or `.json` of an evaluation on one layout.

    `agents` picks strategies and their order; by default all of the file's, in its order.

    Raises:
        GalleyError: the file holds no such table, it is not complete, or an agent is not in it.
    """
    if path.suffix == ".json":
        table = _played(GameScores.load(path), path, layout, agents)
    else:
        table = PayoffTable.load(path)
        unknown = [name for name in agents if name not in table.names]
        if unknown:
            raise GalleyError(f"{path}: holds no {', '.join(unknown)}; it holds {', '.join(table.names)}")
        for name in [name for name in table.names if agents and name not in agents]:
            table.remove(table.names.index(name))
        if agents and table.names != list(agents):
            table = _reordered(table, agents)
    missing = table.missing()
    if missing or not len(table):
        told = f"{len(missing)} cells are missing" if missing else "it is empty"
        raise GalleyError(f"{path}: the table cannot be drawn: {told}; let the run or evaluation complete it")
    return table


def _played(results: GameScores, path: Path, layout: str | None, agents: Sequence[str]) -> PayoffTable:
    """The table of an evaluation on one layout."""
    if layout is None:
        if len(results.layouts) != 1:
            raise GalleyError(f"{path}: holds {', '.join(results.layouts)}; name one with --layout")
        layout = results.layouts[0]
    here = [cell for cell in results if cell.layout == layout]
    names = list(agents) or list(dict.fromkeys(cell.seat_0 for cell in here))
    table = PayoffTable(names)
    for seat_0, seat_1 in table.missing():
        cell = results.get(layout, names[seat_0], names[seat_1])
        if cell is not None:
            table.set(seat_0, seat_1, cell.mean_score.mean, cell.mean_score.standard_error, len(cell.scores))
    return table


def _reordered(table: PayoffTable, names: Sequence[str]) -> PayoffTable:
    """The same cells, the strategies in another order."""
    ordered = PayoffTable(names)
    for seat_0, one in enumerate(names):
        for seat_1, other in enumerate(names):
            cell = table.cell(table.names.index(one), table.names.index(other))
            if cell is not None:
                ordered.set(seat_0, seat_1, cell.mean, cell.standard_error, cell.games)
    return ordered
