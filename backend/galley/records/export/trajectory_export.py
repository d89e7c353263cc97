"""All rounds of a study as trajectories: our own JSON Lines in a zip, or the field's public schema."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from sqlalchemy import Connection

from galley.errors import GalleyError
from galley.files.whole import whole_path
from galley.kitchen.trajectory import to_text
from galley.records.database.tables import TICKS
from galley.records.export.csv_file import CsvFile
from galley.records.export.human_data import HUMAN_DATA, rows_of
from galley.records.export.parquet_file import ParquetFile
from galley.records.export.sheet_file import PartFile
from galley.records.reading.round_replay import Replayed, replay_round
from galley.records.rows import RoundRow
from galley.records.store import queries
from galley.records.store.store import Store

# No file knows when it was written, so that equal records make equal archives. The oldest date that zip has.
DATE = (1980, 1, 1, 0, 0, 0)


def export_trajectories(store: Store, study: str, out: Path, include_test: bool = False) -> int:
    """Episodes written to the zip file `out`: `PARTICIPANT-ROUND[-EPISODE].jsonl`, as `galley.kitchen` reads.

    Raises:
        GalleyError: nobody visited the study or the file cannot be written.
    """
    written = 0
    try:
        with (
            store.reading() as connection,
            whole_path(out) as part,
            zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive,
        ):
            for participant, row, found in _rounds(connection, store, study, include_test):
                for number, trajectory in enumerate(found.trajectories, 1):
                    episode = f"-{number}" if row.episodes > 1 else ""
                    member = zipfile.ZipInfo(f"{participant}-{row.id}{episode}.jsonl", DATE)
                    archive.writestr(member, to_text(trajectory), zipfile.ZIP_DEFLATED)
                    written += 1
    except OSError as error:
        raise GalleyError(f"{out}: {error.strerror or error}; name another file with --out") from None
    return written


def export_human_data(store: Store, study: str, out: Path, include_test: bool = False) -> int:
    """Ticks written to `out`, Parquet if it ends so and CSV otherwise, in the schema of HUMAN_DATA.

    Rounds that do not replay to what was stored are left out.

    Raises:
        GalleyError: nobody visited the study or the file cannot be written.
    """
    kind: type[PartFile] = ParquetFile if out.suffix == ".parquet" else CsvFile
    try:
        with store.reading() as connection, kind(out.parent, replace(HUMAN_DATA, name=out.stem)) as file:
            for _, row, found in _rounds(connection, store, study, include_test):
                if found.problems:
                    continue
                for tick in rows_of(row, found, queries.participants(connection, row)):
                    file.write(tick)
        if file.path != out:
            file.path.replace(out)
    except OSError as error:
        raise GalleyError(f"{out}: {error.strerror or error}; name another file with --out") from None
    return file.rows


def _rounds(
    connection: Connection, store: Store, study: str, include_test: bool
) -> Iterator[tuple[str, RoundRow, Replayed]]:
    """Every round once, under the visit with the lower seat, if it can be played at all."""
    queries.must_know(connection, store.name, study)
    for visit in queries.visits(connection, study, tests=include_test):
        for round_id in queries.rounds_of_visit(connection, visit.id):
            row = queries.round_row(connection, round_id)
            if row.human.visit_id != visit.id:
                continue
            try:
                ticks = [tick["tick"] for tick in queries.of_round(connection, TICKS, round_id)]
                found = replay_round(row, ticks)
            except GalleyError:  # `galley trajectories verify` tells what is wrong with it
                continue
            yield visit.participant, row, found
