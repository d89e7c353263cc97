"""What the benchmarks of live rounds share: a server in a process of its own, people, a bare timer.

People share as few processes as asked for. They come through the pages as browsers do, press keys at a human
rate, and count the ticks in the frames they get: a tick that is missing or comes twice is told. Lateness is
what the server recorded of every tick: when its frame was handed to the socket, minus its deadline. Beside it
a bare timer keeps as many deadlines in a process of its own: what is late there, the machine is late with.
"""

from __future__ import annotations

import asyncio
import itertools
import multiprocessing
import os
import random
import re
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import uvloop
from websockets.asyncio.client import ClientConnection, connect

from galley.protocol.messages import PROTOCOL

ROOT = Path(__file__).resolve().parents[1]
LAYOUTS = (
    "cramped_room",
    "asymmetric_advantages",
    "coordination_ring",
    "forced_coordination",
    "counter_circuit",
)
CONTROL_P99_MS = 5.0
"""A bare timer that is later than this at the 99th percentile says that the machine was busy otherwise."""

KEYS = ("up", "down", "left", "right")
BEGIN_AT_ONCE = 8
START_WITHIN_S = 2.0
TICK = '{"type":"tick","tick":'
ENDED = '{"type":"ended"'


@dataclass(frozen=True)
class Load:
    """What to run: so many rounds of so many ticks at once, their people in so many processes."""

    rounds: int
    ticks: int
    tick_ms: int
    clients: int

    @property
    def length_s(self) -> float:
        """How long a round is played."""
        return self.ticks * self.tick_ms / 1000


@dataclass(frozen=True)
class Run:
    """What one load gave.

    `ticks` is a row for each tick on record: round, tick, deadline, lateness, 1 if the agent was late,
    decision time (NaN if none), times in ms; `control` is the bare timer's lateness. Shares are of one core.
    """

    load: Load
    ticks: np.ndarray
    control: np.ndarray
    problems: list[str]
    server_share: float
    people_share: float
    idle_mib: float
    playing_mib: float
    most_mib: float

    def lateness(self, percent: float) -> float:
        """A percentile of the ticks' lateness, ms; NaN without ticks."""
        return float(np.percentile(self.ticks[:, 3], percent)) if len(self.ticks) else float("nan")

    def control_lateness(self, percent: float) -> float:
        """The same percentile of the bare timer's lateness, ms."""
        return float(np.percentile(self.control, percent))


# ---- the server --------------------------------------------------------------------------------------------


def study_text(load: Load, agent: str, layout: str, seed: int) -> str:
    """A study of one round."""
    return f"""format: 1
title: Benchmark
seed: {seed}
tick_ms: {load.tick_ms}
horizon_ticks: {load.ticks}
countdown_s: 1
completion: {{code: DONE}}
stages:
  - {{kind: consent, text: consent}}
  - {{kind: rounds, agents: [{agent}], layouts: [{{layout: {layout}}}]}}
  - {{kind: debrief, text: debrief}}
"""


@contextmanager
def server(
    workspace: Path, database: Path, limited: bool = False
) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A server's URL and process, until the block ends."""
    command = [sys.executable, "-c", "from galley.cli import main; main()", "serve", str(workspace)]
    command += ["--port", "0", "--database", f"sqlite:///{database}"]
    # All people of a benchmark come from one address.
    no_limits = {"REQUESTS_PER_S": "0", "BEGINS_PER_MIN": "0", "ADDRESS_MESSAGES_PER_S": "1000000"}
    environ = {**os.environ, **({} if limited else no_limits)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environ) as process:
        try:
            assert process.stdout is not None
            for line in process.stdout:
                if found := re.search(r"http://\S+", line):
                    yield found[0], process
                    break
            else:
                raise RuntimeError("the server did not start")
        finally:
            process.send_signal(signal.SIGTERM)


def cpu_s(pid: int) -> float:
    """Processor seconds that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


def memory_mib(pid: int, field: str) -> float:
    """Memory of a process: VmRSS now, VmHWM the most so far."""
    found = re.search(rf"{field}:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    return int(found[1]) / 1024 if found else 0.0


# ---- the people --------------------------------------------------------------------------------------------


def begin(url: str, study: str) -> str:
    """The path of a new visit that has come to its round."""
    request = urllib.request.Request(f"{url}/s/{study}/begin", method="POST", data=b"")
    with urllib.request.urlopen(request) as page:
        path = str(urllib.parse.urlsplit(page.url).path)
    form = urllib.parse.urlencode({"step": "consent", "choice": "agree"}).encode()
    with urllib.request.urlopen(f"{url}{path}", data=form):
        return path


async def press_keys(socket: ClientConnection, rng: random.Random) -> None:
    """Walk here and there and interact, four or five key events a second, until cancelled."""
    seq = itertools.count()

    async def key(name: str, down: str) -> None:
        now_ms = f"{time.monotonic() * 1e3:.3f}"
        await socket.send(
            f'{{"type":"key","key":"{name}","down":{down},"seq":{next(seq)},"client_ms":{now_ms}}}'
        )

    while True:
        name = rng.choice(KEYS)
        await key(name, "true")
        await asyncio.sleep(rng.uniform(0.08, 0.6))
        await key(name, "false")
        if rng.random() < 0.5:
            await key("interact", "true")
            await asyncio.sleep(0.08)
            await key("interact", "false")
        await asyncio.sleep(rng.uniform(0.05, 0.4))


async def see_every_tick(socket: ClientConnection, ticks: int) -> str:
    """Read frames to the end of the round; what was missing, or an empty text."""
    seen = 0
    async for frame in socket:
        text = str(frame)
        if text.startswith(TICK):
            seen += 1
            tick = int(text[len(TICK) : text.index(",", len(TICK))])
            if tick != seen:
                return f"tick {tick} came where {seen} was due"
        elif text.startswith(ENDED):
            return "" if seen == ticks else f"it ended after {seen} ticks"
    return f"the connection closed after {seen} ticks"


async def one_person(url: str, path: str, number: int, go: asyncio.Event, load: Load) -> str:
    """Play one round to its end; what went wrong, or an empty text."""
    rng = random.Random(number)
    try:
        async with connect(
            url.replace("http", "ws") + f"{path}/play", compression=None, ping_interval=None, max_queue=None,
            open_timeout=60,
        ) as socket:  # fmt: skip
            await socket.send(f'{{"type":"hello","protocol":{PROTOCOL},"tab":"tab {number}"}}')
            await go.wait()
            await asyncio.sleep(rng.uniform(0.0, START_WITHIN_S))
            await socket.send('{"type":"ready"}')
            typing = asyncio.create_task(press_keys(socket, rng))
            try:
                trouble = await see_every_tick(socket, load.ticks)
            finally:
                typing.cancel()
                with suppress(asyncio.CancelledError, Exception):
                    await typing
    except Exception as error:
        trouble = f"{type(error).__name__}: {error}"
    return f"round {number}: {trouble}" if trouble else ""


def people(url: str, jobs: list[tuple[int, str]], load: Load, here: Any, go: Any, found: Any) -> None:
    """A process full of people: all begin, tell that they are there, and play when told to."""

    async def all_of_them() -> list[str]:
        told, places = asyncio.Event(), asyncio.Semaphore(BEGIN_AT_ONCE)

        async def arrive(study: str) -> str:
            async with places:
                return await asyncio.to_thread(begin, url, study)

        paths = await asyncio.gather(*(arrive(study) for _, study in jobs))
        playing = []
        for (number, _), path in zip(jobs, paths, strict=True):
            playing.append(asyncio.create_task(one_person(url, path, number, told, load)))
            await asyncio.sleep(0.01)
        await asyncio.sleep(1.0)
        here.put(len(jobs))
        await asyncio.to_thread(go.wait)
        told.set()
        return await asyncio.gather(*playing)

    found.put(("people", uvloop.run(all_of_them())))


def control(load: Load, go: Any, found: Any) -> None:
    """A bare timer: as many deadlines a second, and nothing done at them."""

    async def tick() -> list[float]:
        loop = asyncio.get_running_loop()
        await asyncio.to_thread(go.wait)
        late: list[float] = []
        done = loop.create_future()
        step_s = load.tick_ms / 1000 / load.rounds
        begin_s = loop.time() + START_WITHIN_S

        def due(number: int) -> None:
            late.append((loop.time() - begin_s - number * step_s) * 1000)
            if number + 1 < load.ticks * load.rounds:
                loop.call_at(begin_s + (number + 1) * step_s, due, number + 1)
            else:
                done.set_result(None)

        loop.call_at(begin_s, due, 0)
        await done
        return late

    found.put(("control", uvloop.run(tick())))


# ---- one run -----------------------------------------------------------------------------------------------


def play(
    load: Load,
    make_workspace: Callable[[Path, Load], list[str]],
    watch: Callable[[int, float, str], None] = lambda _pid, _length_s, _url: None,
    *,
    limited: bool = False,
) -> Run:
    """Serve and play one load.

    `make_workspace` fills a folder and gives the names of its studies, which people take in turn. `watch` is
    called with the server's process when all play, how long they will, and its URL. The server sets no limits
    by address unless it is `limited`.
    """
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory(prefix="galley-rounds-") as name:
        folder = Path(name)
        studies = make_workspace(folder, load)
        database = folder / "records.sqlite"
        with server(folder, database, limited) as (url, process):
            idle_mib = memory_mib(process.pid, "VmRSS")
            here, found, go = context.Queue(), context.Queue(), context.Event()
            jobs = [(number, studies[number % len(studies)]) for number in range(load.rounds)]
            workers = [
                context.Process(target=people, args=(url, jobs[n :: load.clients], load, here, go, found))
                for n in range(load.clients)
            ]
            workers.append(context.Process(target=control, args=(load, go, found)))
            for worker in workers:
                worker.start()
            for _ in range(load.clients):
                here.get(timeout=60 + load.rounds)
            go.set()
            time.sleep(2 * START_WITHIN_S)
            pids = [process.pid, *(int(worker.pid or 0) for worker in workers[:-1])]
            before, began_s = [cpu_s(pid) for pid in pids], time.monotonic()
            watch(process.pid, load.length_s, url)
            time.sleep(load.length_s * 0.7)
            spent_s = time.monotonic() - began_s
            shares = [(cpu_s(pid) - cpu) / spent_s for pid, cpu in zip(pids, before, strict=True)]
            playing_mib = memory_mib(process.pid, "VmRSS")
            answers = [found.get(timeout=load.length_s + 120) for _ in workers]
            for worker in workers:
                worker.join()
            most_mib = memory_mib(process.pid, "VmHWM")
        ticks, finished = _records(database)
    problems = [problem for kind, told in answers if kind == "people" for problem in told if problem]
    if finished != load.rounds:
        problems.append(f"{load.rounds} rounds began, {finished} finished")
    bare = np.array(next(late for kind, late in answers if kind == "control"))
    return Run(load, ticks, bare, problems, shares[0], sum(shares[1:]), idle_mib, playing_mib, most_mib)


def _records(database: Path) -> tuple[np.ndarray, int]:
    """The ticks as `Run` has them, and how many rounds were played to their end."""
    columns = "round_id, tick, deadline_ms, lateness_ms, late, decision_ms"
    with sqlite3.connect(database) as connection:
        rows = connection.execute(f"SELECT {columns} FROM ticks ORDER BY round_id, tick").fetchall()
        finished = connection.execute("SELECT count(*) FROM rounds WHERE status = 'finished'").fetchone()[0]
    return np.array(rows, dtype=np.float64).reshape(-1, 6), finished
