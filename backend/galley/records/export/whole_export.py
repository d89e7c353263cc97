"""Everything that an export can hold, in one folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from galley.records.export.bonus_payments import export_bonuses
from galley.records.export.study_export import export_study
from galley.records.export.trajectory_export import export_human_data, export_trajectories
from galley.records.store.store import Store


@dataclass(frozen=True, slots=True)
class Wanted:
    """What an export holds beside its tables, in which formats those are, and of whom."""

    formats: Sequence[str] = ("csv",)
    trajectories: bool = True
    human_data: bool = True
    bonuses: bool = True
    tests: bool = False


def write_files(store: Store, study: str, out: Path, wanted: Wanted, notice: str = "") -> dict[Path, str]:
    """What was written to the folder `out`, file by file; the data dictionary begins with the `notice`.

    Raises:
        GalleyError: as `export_study`.
    """
    tables = export_study(store, study, out, wanted.formats, wanted.tests, notice)
    written = {out / file: f"{rows} rows" for file, rows in tables.items()}
    if wanted.trajectories:
        file = out / "trajectories.zip"
        written[file] = f"{export_trajectories(store, study, file, wanted.tests)} episodes"
    if wanted.human_data:
        file = out / "human-data.csv"
        written[file] = f"{export_human_data(store, study, file, wanted.tests)} rows"
    if wanted.bonuses:
        file = out / "bonuses.csv"
        written[file] = f"{export_bonuses(store, study, file, wanted.tests)} people"
    return written
