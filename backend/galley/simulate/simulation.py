"""Many simulated participants of one study, on a server that is up or on one of their own."""

from __future__ import annotations

import asyncio
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AsyncExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx

from galley.agents.catalogue import Catalogue
from galley.agents.protocol import Agent
from galley.agents.scripted import Random
from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.kitchen.layout_file import load_layouts
from galley.simulate.delay import delayed
from galley.simulate.participant import Participant, World, known_answers
from galley.simulate.results import Figures
from galley.study.study import Study, load_study
from galley.workspace import Workspace

PAGE_TIMEOUT_S = 60.0
STOP_WITHIN_S = 20.0
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


def simulate(workspace: Workspace, simulation: Simulation, url: str | None = None) -> dict[str, Any]:
    """The report of a simulation; without a URL it has a server and records of its own, gone at the end.

    Raises:
        GalleyError: the workspace has no such study or agent, or the server cannot be reached.
        InvalidFiles: a file of the workspace cannot be used.
    """
    study = load_study(workspace, simulation.study)
    world = _world(workspace, study, simulation)
    began_s = time.monotonic()
    if url is not None:
        asyncio.run(_all(url.rstrip("/"), simulation, study, world))
    else:
        with own_server(workspace, simulation.study) as own:
            began_s = time.monotonic()
            asyncio.run(_all(own, simulation, study, world))
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


async def _all(url: str, simulation: Simulation, study: Study, world: World) -> None:
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

        async def one(number: int) -> None:
            rng = random.Random(f"{simulation.seed} {number}")
            async with (
                places,
                httpx.AsyncClient(base_url=url, follow_redirects=True, timeout=PAGE_TIMEOUT_S) as http,
            ):
                await Participant(world, http, rng, _params(study, simulation.seed, number)).visit()

        await asyncio.gather(*(one(number) for number in range(simulation.participants)))


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
def own_server(workspace: Workspace, study: str) -> Iterator[str]:
    """The URL of a server in a process of its own, with a database that is gone when the block ends.

    Raises:
        GalleyError: it does not start; with what it said.
    """
    with tempfile.TemporaryDirectory(prefix="galley-simulate-") as folder:
        log = Path(folder) / "log"
        command = [sys.executable, "-c", "from galley.cli import main; main()", "serve", str(workspace.path)]
        command += ["--study", study, "--port", "0", "--database", str(Path(folder) / "simulated.sqlite")]
        with (
            log.open("wb") as out,
            subprocess.Popen(  # noqa: S603
                command, stdout=out, stderr=subprocess.STDOUT, env={**os.environ, **UNLIMITED}
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
