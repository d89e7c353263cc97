"""Writes one export in a process of its own, so that no running round waits for it.

Run as a module: reads one JSON object from standard input (`database`, `out`, and either `study`, `kind` and
`tests`, or `round` for a film of it), writes the file `out`, and exits with 1 after one line on standard
error when that cannot be done.
"""

from __future__ import annotations

import json
import sys
import tempfile
import zipfile
from pathlib import Path

from galley.errors import GalleyError
from galley.film.write import write_film
from galley.records import Store
from galley.records.export.study_export import export_study
from galley.records.export.trajectory_export import export_human_data, export_trajectories
from galley.records.reading.films import footage_of_round
from galley.workspace import frontend_folder

TABLES = ("csv", "jsonl", "parquet")


def write_export(database: str, study: str, kind: str, tests: bool, out: Path) -> None:
    """Write one kind of export of a study to the file `out`.

    Raises:
        GalleyError: the database or the study is not there.
    """
    with Store.open(database, must_exist=True) as store:
        if kind in TABLES:
            with tempfile.TemporaryDirectory(dir=out.parent) as folder:
                export_study(store, study, Path(folder), formats=(kind,), include_test=tests)
                _zipped(Path(folder), out)
        elif kind == "trajectories":
            export_trajectories(store, study, out, include_test=tests)
        else:
            export_human_data(store, study, out, include_test=tests)


def write_round_film(database: str, round_id: int, out: Path) -> None:
    """Write a round as a film to the file `out`, a .gif or .mp4.

    Raises:
        GalleyError: there is no such round, or the extra `video` is missing.
    """
    with Store.open(database, must_exist=True) as store:
        filmed = footage_of_round(store, round_id)
    write_film(filmed, frontend_folder() / "sprites", out)


def _zipped(folder: Path, out: Path) -> None:
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.iterdir()):
            archive.write(file, file.name)


def main() -> None:
    """Do what standard input asks for."""
    job = json.loads(sys.stdin.read())
    try:
        if "round" in job:
            write_round_film(job["database"], job["round"], Path(job["out"]))
        else:
            write_export(job["database"], job["study"], job["kind"], job["tests"], Path(job["out"]))
    except (GalleyError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(1)


if __name__ == "__main__":
    main()
