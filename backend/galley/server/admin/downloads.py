"""Downloads of a study's records, each written by a process of its own."""

from __future__ import annotations

import asyncio
import json
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from fastapi import Request
from fastapi.responses import FileResponse, Response
from starlette.background import BackgroundTask

from galley.records import queries
from galley.records.rows import SessionRow
from galley.server.admin.desk import Desk

AT_ONCE = 1


@dataclass(frozen=True, slots=True)
class Download:
    """One kind of download: what it is, the ending of its file, and its media type."""

    title: str
    about: str
    ending: str
    media: str = "application/zip"


DOWNLOADS = {
    "csv": Download("CSV", "Every table, long and wide, with the data dictionary.", "csv.zip"),
    "jsonl": Download("JSON Lines", "The same tables, one JSON object a line.", "jsonl.zip"),
    "parquet": Download("Parquet", "The same tables for pandas, Arrow, R and DuckDB.", "parquet.zip"),
    "trajectories": Download("Trajectories", "Every round, ready to be replayed.", "trajectories.zip"),
    "human-data": Download(
        "Human data",
        "State, joint action and reward of every tick, as in the field's public human data.",
        "human-data.csv",
        "text/csv",
    ),
    "human-data-parquet": Download(
        "Human data, Parquet",
        "The same as Parquet.",
        "human-data.parquet",
        "application/vnd.apache.parquet",
    ),
}


class DownloadPages:
    """The files that a researcher can take home."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._turns = asyncio.Semaphore(AT_ONCE)

    async def download(self, request: Request, session: SessionRow) -> Response:
        """One file, made now from the records as they are."""
        study, kind = request.path_params["study"], request.path_params["kind"]
        download = DOWNLOADS.get(kind)
        if download is None or study not in await self._desk.read(queries.studies):
            return self._desk.missing(session, "download; nobody has visited this study yet")
        folder = Path(await asyncio.to_thread(tempfile.mkdtemp, prefix="galley-export-"))
        try:
            out = folder / f"out.{download.ending}"
            tests = bool(request.query_params.get("tests"))
            async with self._turns:
                problem = await asyncio.to_thread(_in_a_process, self._desk.database, study, kind, tests, out)
        except BaseException:
            await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
            raise
        if problem:
            await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
            return self._desk.gate.plain(session, 500, "No file was made", problem)
        stamp = f"{datetime.now(UTC):%Y%m%d-%H%M%S}"
        return FileResponse(
            out,
            media_type=download.media,
            filename=f"{study}-{stamp}.{download.ending}",
            headers={"cache-control": "no-store"},
            background=BackgroundTask(shutil.rmtree, folder, ignore_errors=True),
        )


def _in_a_process(database: str, study: str, kind: str, tests: bool, out: Path) -> str:
    """Empty once the file is written, else what went wrong. The database's URL travels on standard input:
    command lines are for everybody on the machine to read.
    """
    job = {"database": database, "study": study, "kind": kind, "tests": tests, "out": str(out)}
    command = [sys.executable, "-m", "galley.server.admin.exporting"]
    done = subprocess.run(command, input=json.dumps(job), capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else "The export stopped without saying why."
