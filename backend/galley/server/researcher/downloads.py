"""Downloads of a study's records, each written by a process of its own."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from galley.errors import GalleyError
from galley.files.scratch import Scratch
from galley.film.write import can_draw
from galley.records.rows import SessionRow
from galley.records.store import queries
from galley.server.researcher.page_context import PageContext, number

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


FILMS = {"gif": "image/gif", "mp4": "video/mp4"}
"""Films of one round, by their ending, with their media types."""


class DownloadPages:
    """The files that a researcher can take home."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._turns = asyncio.Semaphore(AT_ONCE)

    async def download(self, request: Request, session: SessionRow) -> Response:
        """One file, made now from the records as they are."""
        study, kind = request.path_params["study"], request.path_params["kind"]
        download = DOWNLOADS.get(kind)
        if download is None or study not in await self._context.read(queries.studies):
            return self._context.missing(session, "download; nobody has visited this study yet")
        tests = bool(request.query_params.get("tests"))
        job = {"study": study, "kind": kind, "tests": tests}
        return await self._made(session, job, f"{study}-{_stamp()}.{download.ending}", download.media)

    async def film(self, request: Request, session: SessionRow) -> Response:
        """One round as a film, made now."""
        round_id, ending = number(request, "round"), request.path_params["kind"]
        try:
            row = await self._context.read(lambda connection: queries.round_row(connection, round_id))
        except GalleyError:
            return self._context.missing(session, "round")
        if ending not in FILMS or not can_draw():
            return self._context.missing(session, "film: this server makes none")
        name = f"{row.study}-round-{round_id}.{ending}"
        return await self._made(session, {"round": round_id}, name, FILMS[ending])

    async def _made(self, session: SessionRow, job: dict[str, Any], name: str, media: str) -> Response:
        """The file that a process of its own makes of `job`, or a page that says why there is none."""
        scratch = await asyncio.to_thread(Scratch, "galley-export-")
        try:
            out = scratch.path / f"out{Path(name).suffix}"
            job |= {"database": self._context.store.url, "out": str(out)}
            async with self._turns:
                problem = await asyncio.to_thread(_in_a_process, job, scratch.descriptor)
        except BaseException:
            await asyncio.to_thread(scratch.close)
            raise
        if problem:
            await asyncio.to_thread(scratch.close)
            return self._context.logins.plain(session, 500, "No file was made", problem)
        return FileResponse(
            out,
            media_type=media,
            filename=name,
            headers={"cache-control": "no-store"},
            background=BackgroundTask(scratch.close),
        )


def _stamp() -> str:
    return f"{datetime.now(UTC):%Y%m%d-%H%M%S}"


def _in_a_process(job: dict[str, Any], scratch: int) -> str:
    """Empty once the file is written, else what went wrong. The database's URL travels on standard input:
    command lines are for everybody on the machine to read. The process holds the lock of its `scratch`.
    """
    command = [sys.executable, "-m", "galley.server.researcher.export_process"]
    done = subprocess.run(  # noqa: S603
        command, input=json.dumps(job), capture_output=True, text=True, check=False, pass_fds=[scratch]
    )
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else "The export stopped without saying why."
