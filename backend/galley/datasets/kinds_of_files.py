"""Which kind of recorded games a file holds, told by what stands in it."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from galley.datasets.field_games import FIELD_COLUMNS, field_games
from galley.datasets.lsi_study import COLUMNS as STUDY_COLUMNS
from galley.datasets.overcooked_games import HumanGame
from galley.errors import GalleyError

CSV_READERS: Final[Mapping[str, Callable[[Path], list[HumanGame]]]] = {"field": field_games}
"""What reads the games of a CSV file whose every transition is compared, by kind."""

KINDS: Final = (
    "pickles of human games as the overcooked-ai package ships them, CSV in the field's schema as "
    "`galley export --human-data` writes it, and CSV of the LSI user study"
)


def csv_kind(path: Path) -> str:
    """`field` or `study`, by the columns of a CSV file: the kind of which it has more.

    Raises:
        GalleyError: it cannot be read, or has no column of either.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            names = set(next(csv.reader(file), ()))
    except OSError as error:
        raise GalleyError(f"{path}: cannot be read ({error.strerror or error}); check the path") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise GalleyError(f"{path}: is no CSV ({error}); what is read here: {KINDS}") from None
    found = {"field": len(names & {*FIELD_COLUMNS}), "study": len(names & {*STUDY_COLUMNS})}
    if not any(found.values()):
        raise GalleyError(f"{path}:1: none of its columns is known here; what is read here: {KINDS}")
    return max(found, key=lambda kind: found[kind])
