"""Many simulated participants of one study, on a server that is up or on one of their own."""

from __future__ import annotations

import asyncio
import os
import random
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AsyncExitStack, ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx

from galley.agents.catalogue import Catalogue
from galley.agents.protocol import Agent
from galley.agents.scripted import Random
from galley.errors import GalleyError
from galley.files.scratch import Scratch
from galley.kitchen import Layout
from galley.kitchen.layout_file import load_layouts
from galley.progress_lines import Progress, untold
from galley.records.export.simulated_export import new_folder, write_simulated
from galley.simulate.delay import delayed
from galley.simulate.participant import Participant, World, known_answers
from galley.simulate.results import Figures
from galley.study.study import Study, load_study
from galley.workspace import Workspace

PAGE_TIMEOUT_S = 60.0
STOP_WITHIN_S = 20.0
DATABASE = "simulated.sqlite"
UNLIMITED = {"REQUESTS_PER_S": "0", "BEGINS_PER_MIN": "0", "ADDRESS_MESSAGES_PER_S": "1000000"}
"""Settings of a server of one's own: all simulated participants come from one address."""


@dataclass(frozen=True)
class Simulation:
    """What to simulate: `in_flight` participants at a time, `dropout` of them leaving somewhere."""

    study: str
    participants: int
    seed: int
    dropout: float = 0.0
    in_flight: int = 10
    agent: str = "myopic"
    delay_ms: float = 0.0

    def command(self) -> str:
        """The command that simulates the same."""
        options = {"participants": self.participants, "seed": self.seed, "agent": self.agent}
        told = " ".join(f"--{name} {value}" for name, value in options.items())
        return f"galley simulate {self.study} {told}" + (
            f" --dropout {self.dropout:g}" if self.dropout else ""
        )


def simulate(
    workspace: Workspace,
    simulation: Simulation,
    url: str | None = None,
    out: Path | None = None,
    progress: Progress = untold,
) -> dict[str, Any]:
    """The report of a simulation; without a URL it has a server and records of its own, gone at the end.

    With `out` these are exported to that new folder before; what was written is in the report as `files`.

    Raises:
        GalleyError: the workspace has no such study or agent, or the server cannot be reached.
        InvalidFiles: a file of the workspace cannot be used.
    """
    study = load_study(workspace, simulation.study)
    world = _world(workspace, study, simulation)
    if url is not None:
        return _simulated(url.rstrip("/"), simulation, study, world, progress)
    with ExitStack() as stack:
        place = None if out is None else stack.enter_context(new_folder(out))
        scratch = Scratch("galley-simulate-")
        folder = stack.enter_context(scratch)
        with own_server(workspace, simulation.study, scratch) as own:
            report = _simulated(own, simulation, study, world, progress)
        if out is not None and place is not None:
            written = write_simulated(folder / DATABASE, study.name, place, simulation.command())
            report["files"] = {(out / file).as_posix(): count for file, count in written.items()}
    return report


def _simulated(
    url: str, simulation: Simulation, study: Study, world: World, progress: Progress
) -> dict[str, Any]:
    began_s = time.monotonic()
    try:
        asyncio.run(_all(url, simulation, study, world, progress))
    finally:
        world.thinks.shutdown()
    return world.figures.report(asdict(simulation), time.monotonic() - began_s)


def _world(workspace: Workspace, study: Study, simulation: Simulation) -> World:
    bundle = Catalogue(workspace).bundle(simulation.agent)

    def make(layout: Layout) -> Agent:
        # Somebody who was never in such a kitchen tries this and that.
        return bundle.make() if bundle.supports(layout.name) else Random()

    return World(
        simulation.study,
        make,
        load_layouts(workspace),
        known_answers(study.questionnaires),
        Figures(),
        ThreadPoolExecutor(1, "think"),
        simulation.dropout,
    )


async def _all(url: str, simulation: Simulation, study: Study, world: World, progress: Progress) -> None:
    """Let everybody take part, no more than `in_flight` at a time."""
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.netloc:
        raise GalleyError(f"{url}: not the address of a server; give one such as http://127.0.0.1:8000")
    async with AsyncExitStack() as stack:
        if simulation.delay_ms:
            if parts.scheme != "http":
                raise GalleyError(f"{url}: --delay-ms works with http:// only")
            url = await stack.enter_async_context(delayed(url, simulation.delay_ms / 1000.0))
        await _reach(url)
        places = asyncio.Semaphore(simulation.in_flight)
        over = 0

        async def tell() -> None:
            while True:
                progress(f"ticks played {world.figures.ticks}, visits over", over, simulation.participants)
                await asyncio.sleep(1.0)

        async def one(number: int) -> None:
            nonlocal over
            rng = random.Random(f"{simulation.seed} {number}")
            async with (
                places,
                httpx.AsyncClient(base_url=url, follow_redirects=True, timeout=PAGE_TIMEOUT_S) as http,
            ):
                await Participant(world, http, rng, _params(study, simulation.seed, number)).visit()
            over += 1

        telling = asyncio.create_task(tell())
        try:
            await asyncio.gather(*(one(number) for number in range(simulation.participants)))
        finally:
            telling.cancel()


async def _reach(url: str) -> None:
    try:
        async with httpx.AsyncClient(timeout=PAGE_TIMEOUT_S) as http:
            await http.get(f"{url}/healthz")
    except httpx.HTTPError as error:
        raise GalleyError(
            f"{url}: no server can be reached there ({type(error).__name__}); start one with `galley serve`"
        ) from None


def _params(study: Study, seed: int, number: int) -> dict[str, str]:
    """The link of one participant: an invitation of their own, a name where a service would give one."""
    params = {}
    invited = sorted(study.invitations or ())
    if invited:
        params["code"] = invited[number % len(invited)]
    told = study.config.recruitment.participant
    if told is not None:
        params[told] = f"simulated-{seed}-{number}"
    return params


@contextmanager
def own_server(workspace: Workspace, study: str, scratch: Scratch) -> Iterator[str]:
    """The URL of a server in a process of its own until the block ends; its records are kept in `scratch`.

    Raises:
        GalleyError: it does not start; with what it said.
    """
    log = scratch.path / "log"
    command = [sys.executable, "-c", "from galley.cli import main; main()", "serve", str(workspace.path)]
    command += ["--study", study, "--port", "0", "--database", str(scratch.path / DATABASE)]
    with (
        log.open("wb") as out,
        subprocess.Popen(  # noqa: S603
            command,
            stdout=out,
            stderr=subprocess.STDOUT,
            env={**os.environ, **UNLIMITED},
            pass_fds=[scratch.descriptor],
        ) as process,
    ):
        try:
            yield _address(process, log)
        finally:
            process.terminate()
            try:
                process.wait(STOP_WITHIN_S)
            except subprocess.TimeoutExpired:
                process.kill()


def _address(process: subprocess.Popen[bytes], log: Path) -> str:
    while process.poll() is None:
        found = re.search(r"^http://\S+$", log.read_text(encoding="utf-8"), re.MULTILINE)
        if found:
            return found[0]
        time.sleep(0.05)
    raise GalleyError(f"the server did not start: {log.read_text(encoding='utf-8').strip()}")
