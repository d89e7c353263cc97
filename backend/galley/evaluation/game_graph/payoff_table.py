"""The empirical payoffs of a population, completed cell by cell as it grows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.files.whole import whole_file

_PARTS = ("names", "mean", "standard_error", "games")


@dataclass(frozen=True)
class Cell:
    """What was measured with one strategy on seat 0 and another on seat 1."""

    mean: float
    standard_error: float
    games: int


class PayoffTable:
    """Scores of n named strategies in every seat order; rows sit on seat 0, columns on seat 1.

    Attributes: `names` (in the order of their coming), `mean` and `standard_error` float64 [n, n] (NaN where
    nothing was played yet), `games` int64 [n, n]. One cell holds one seat order; self-play has one only.

    Source: COLE, Algorithm 1 step 1 and Sec. 5 (payoffs of both starting positions).

    Raises:
        ValueError: two strategies have one name.
    """

    def __init__(self, names: Iterable[str] = ()) -> None:
        self.names: list[str] = []
        self.mean: NDArray[np.float64] = np.empty((0, 0))
        self.standard_error: NDArray[np.float64] = np.empty((0, 0))
        self.games: NDArray[np.int64] = np.empty((0, 0), dtype=np.int64)
        for name in names:
            self.add(name)

    def __len__(self) -> int:
        return len(self.names)

    def add(self, name: str) -> int:
        """The number of a new strategy; its row and column are empty.

        Raises:
            ValueError: the name is taken.
        """
        if name in self.names:
            raise ValueError(f"strategy {name!r} is in the table already")
        self.names.append(name)
        self.mean = np.pad(self.mean, (0, 1), constant_values=np.nan)
        self.standard_error = np.pad(self.standard_error, (0, 1), constant_values=np.nan)
        self.games = np.pad(self.games, (0, 1))
        return len(self.names) - 1

    def remove(self, strategy: int) -> str:
        """The name of the strategy that was dropped; those after it move up by one."""
        self._known(strategy)
        self.mean = np.delete(np.delete(self.mean, strategy, 0), strategy, 1)
        self.standard_error = np.delete(np.delete(self.standard_error, strategy, 0), strategy, 1)
        self.games = np.delete(np.delete(self.games, strategy, 0), strategy, 1)
        return self.names.pop(strategy)

    def missing(self) -> list[tuple[int, int]]:
        """The cells (on seat 0, on seat 1) where nothing was played yet, row by row."""
        return [(int(row), int(column)) for row, column in np.argwhere(np.isnan(self.mean))]

    def set(self, seat_0: int, seat_1: int, mean: float, standard_error: float = 0.0, games: int = 1) -> None:
        """Keep the mean score of `games` games of one seat order and its standard error.

        Raises:
            ValueError: no such strategy, no game, or a number that is not finite or below 0.
        """
        self._known(seat_0, seat_1)
        if not (np.isfinite(mean) and mean >= 0 and np.isfinite(standard_error) and standard_error >= 0):
            raise ValueError(f"a payoff must be a finite number from 0 up, not {mean} ± {standard_error}")
        if games < 1:
            raise ValueError(f"a payoff needs at least one game, not {games}")
        self.mean[seat_0, seat_1] = mean
        self.standard_error[seat_0, seat_1] = standard_error
        self.games[seat_0, seat_1] = games

    def measure(self, seat_0: int, seat_1: int, scores: NDArray[np.integer]) -> None:
        """Keep mean and standard error of the `scores` [games] of one seat order.

        Raises:
            ValueError: as `set`.
        """
        error = float(np.std(scores, ddof=1) / np.sqrt(len(scores))) if len(scores) > 1 else 0.0
        self.set(seat_0, seat_1, float(np.mean(scores)), error, len(scores))

    def cell(self, seat_0: int, seat_1: int) -> Cell | None:
        """What was measured in one seat order, None if nothing was."""
        self._known(seat_0, seat_1)
        if not self.games[seat_0, seat_1]:
            return None
        return Cell(
            float(self.mean[seat_0, seat_1]),
            float(self.standard_error[seat_0, seat_1]),
            int(self.games[seat_0, seat_1]),
        )

    def payoffs(self) -> NDArray[np.float64]:
        """Float64 [n, n], symmetric: the mean over both seat orders, each counted alike; NaN where one lacks.

        Source: COLE, Sec. 5: the rewards "at both respective starting positions".
        """
        symmetric: NDArray[np.float64] = (self.mean + self.mean.T) / 2
        return symmetric

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Everything in the table as arrays, for a checkpoint; `from_arrays` reads it again."""
        return {
            "names": np.array(self.names, dtype=np.str_),
            "mean": self.mean.copy(),
            "standard_error": self.standard_error.copy(),
            "games": self.games.copy(),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> PayoffTable:
        """The table that `arrays` told.

        Raises:
            ValueError: an array lacks or has another shape than the others.
        """
        lacking = [part for part in _PARTS if part not in arrays]
        if lacking:
            raise ValueError(f"a table of payoffs has {', '.join(_PARTS)}; {', '.join(lacking)} lacks")
        table = cls(str(name) for name in arrays["names"])
        for part in _PARTS[1:]:
            wanted, found = (len(table), len(table)), arrays[part].shape
            if found != wanted:
                raise ValueError(f"{part} has shape {list(found)}, not {list(wanted)}")
            setattr(table, part, arrays[part].astype(getattr(table, part).dtype))
        return table

    def save(self, path: Path) -> None:
        """Write the table to `path` (.npz), whole or not at all."""
        with whole_file(path) as file:
            names = np.array(self.names, dtype=np.str_)
            np.savez(file, names=names, mean=self.mean, standard_error=self.standard_error, games=self.games)

    @classmethod
    def load(cls, path: Path) -> PayoffTable:
        """The table that was saved at `path`.

        Raises:
            GalleyError: the file cannot be read or holds no table.
        """
        try:
            with np.load(path, allow_pickle=False) as arrays:
                return cls.from_arrays(arrays)
        except OSError as error:
            raise GalleyError(f"{path}: cannot be read ({error.strerror or error})") from None
        except Exception as error:  # a damaged zip raises many things
            raise GalleyError(f"{path}: holds no table of payoffs ({error})") from None

    def _known(self, *strategies: int) -> None:
        for strategy in strategies:
            if not 0 <= strategy < len(self.names):
                raise ValueError(f"strategy {strategy} is none of the {len(self.names)} in the table")


def require_payoffs(payoffs: NDArray[np.floating]) -> NDArray[np.float64]:
    """The payoffs as float64 [n, n].

    Raises:
        ValueError: they are no square, incomplete or negative.
    """
    found = np.asarray(payoffs, dtype=np.float64)
    if found.ndim != 2 or found.shape[0] != found.shape[1] or not found.size:
        raise ValueError(f"payoffs must have shape [n, n] with n from 1 up, not {list(found.shape)}")
    if not np.isfinite(found).all():
        raise ValueError(f"payoffs are not complete: {np.count_nonzero(~np.isfinite(found))} cells lack")
    if found.min() < 0:
        raise ValueError(f"payoffs must not be negative; the least is {found.min()}")
    return found
