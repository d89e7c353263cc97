"""The games that were played, cell by cell: kept in a file, so that nothing is played twice."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
import pydantic
from numpy.typing import ArrayLike

from galley.errors import GalleyError
from galley.files.whole import write_whole

Key = tuple[str, str, str]
"""Layout, the agent on seat 0, the agent on seat 1."""

CSV_COLUMNS: Final = ("layout", "seat_0", "seat_1", "games", "mean", "standard_error", "seed")
"""One row a cell: names, how many games, their mean score, its standard error, the seed of them all."""


class Cell(pydantic.BaseModel):
    """Games of one agent on seat 0 with one on seat 1.

    `fingerprint` tells what was played: the layout and all of both agents that decides how they act.
    """

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)

    layout: str
    seat_0: str
    seat_1: str
    seed: int
    fingerprint: str
    scores: Annotated[tuple[int, ...], pydantic.Field(min_length=1)]

    @property
    def key(self) -> Key:
        """What the cell is found by."""
        return self.layout, self.seat_0, self.seat_1

    @property
    def mean_score(self) -> MeanScore:
        """The mean score and its standard error over games."""
        return MeanScore.of(self.scores)


class _File(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid")

    format: Literal[1] = 1
    cells: list[Cell]


@dataclass(frozen=True)
class MeanScore:
    """A mean score and its standard error."""

    mean: float
    standard_error: float

    @classmethod
    def of(cls, scores: ArrayLike) -> MeanScore:
        """That of the scores of games; a single one has no error."""
        each = np.asarray(scores)
        error = float(np.std(each, ddof=1) / np.sqrt(each.size)) if each.size > 1 else 0.0
        return cls(float(np.mean(each)), error)

    def as_json(self) -> dict[str, float]:
        """As a JSON object."""
        return asdict(self)


class GameScores:
    """Cells by layout and seats; a later cell takes the place of an earlier one."""

    def __init__(self, cells: Iterable[Cell] = ()) -> None:
        self._cells = {cell.key: cell for cell in cells}

    def __iter__(self) -> Iterator[Cell]:
        return iter(self._cells.values())

    def __len__(self) -> int:
        return len(self._cells)

    def add(self, cell: Cell) -> None:
        """Keep the cell."""
        self._cells[cell.key] = cell

    def get(self, layout: str, seat_0: str, seat_1: str) -> Cell | None:
        """The cell, None if it was never played."""
        return self._cells.get((layout, seat_0, seat_1))

    def cell(self, layout: str, seat_0: str, seat_1: str) -> Cell:
        """The cell.

        Raises:
            GalleyError: it was never played.
        """
        found = self.get(layout, seat_0, seat_1)
        if found is None:
            raise GalleyError(
                f"{seat_0} on seat 0 was not played with {seat_1} on seat 1 of {layout}; "
                "play them with galley learn evaluate"
            )
        return found

    @property
    def layouts(self) -> list[str]:
        """The names of all layouts that were played, in the order of their coming."""
        return list(dict.fromkeys(cell.layout for cell in self))

    def save(self, path: Path) -> None:
        """Write all cells to `path` (JSON), whole or not at all."""
        text = json.dumps(_File(cells=list(self)).model_dump(), separators=(",", ":"))
        write_whole(path, text.replace('{"layout"', '\n{"layout"') + "\n")

    @classmethod
    def load(cls, path: Path) -> GameScores:
        """The results that were saved at `path`.

        Raises:
            GalleyError: the file cannot be read or holds something else.
        """
        try:
            return cls(_File.model_validate_json(path.read_bytes()).cells)
        except OSError as error:
            raise GalleyError(f"{path}: cannot be read ({error.strerror or error})") from None
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"])
            raise GalleyError(
                f"{path}: holds no results of galley learn evaluate ({place}: {first['msg']})"
            ) from None

    def save_csv(self, path: Path) -> None:
        """Write one row a cell, with the columns of `CSV_COLUMNS`."""
        text = io.StringIO(newline="")
        writer = csv.DictWriter(text, CSV_COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(_row(cell) for cell in self)
        write_whole(path, text.getvalue())


def _row(cell: Cell) -> dict[str, Any]:
    figure = cell.mean_score
    return {
        "layout": cell.layout,
        "seat_0": cell.seat_0,
        "seat_1": cell.seat_1,
        "games": len(cell.scores),
        "mean": figure.mean,
        "standard_error": figure.standard_error,
        "seed": cell.seed,
    }
