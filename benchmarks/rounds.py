"""How late ticks are when many rounds are played at once on a real server.

A server in its own process serves rounds with a network agent (human-bc) and a planner (myopic) on all
layouts that come with Galley. Clients in processes of their own open one websocket a round and press keys as
a person would. Lateness is what the server recorded of every tick. Beside it runs a bare timer with as many
deadlines a second as the rounds have ticks: where that is late by more than 5 ms at p99, the machine was busy
with something else, and the run is repeated instead of counted.
"""

from __future__ import annotations

import argparse
import asyncio
import itertools
import json
import multiprocessing
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from websockets.asyncio.client import ClientConnection, connect

ROOT = Path(__file__).resolve().parents[1]
LAYOUTS = (
    "cramped_room",
    "asymmetric_advantages",
    "coordination_ring",
    "forced_coordination",
    "counter_circuit",
)
AGENTS = ("human-bc", "myopic")
CONTROL_P99_MS = 5.0
KEYS = ("up", "down", "left", "right")


@dataclass(frozen=True)
class Load:
    """What to run."""

    rounds: int
    ticks: int
    tick_ms: int
    clients: int


@dataclass(frozen=True)
class Result:
    """What one run gave, times in ms: `lateness` and `late` for each tick, `counts` for each round."""

    lateness: np.ndarray
    late: np.ndarray
    counts: list[int]
    drift_ms: float
    control: np.ndarray
    server_cpu: float
    server_mib: float
    problems: list[str]


# ---- the server --------------------------------------------------------------------------------------------


def make_workspace(folder: Path, load: Load) -> list[str]:
    """A workspace with one study per agent and layout, each a single round; the studies' names."""
    for part in ("layouts", "agents", "questionnaires"):
        shutil.copytree(ROOT / part, folder / part)
    (folder / "studies").mkdir()
    names = []
    for number, (layout, agent) in enumerate(itertools.product(LAYOUTS, AGENTS)):
        names.append(f"bench-{number}")
        text = f"""
            format: 1
            title: Benchmark
            seed: {number}
            tick_ms: {load.tick_ms}
            horizon_ticks: {load.ticks}
            countdown_s: 1
            completion: {{code: DONE}}
            stages:
              - {{kind: consent, text: consent}}
              - {{kind: rounds, agents: [{agent}], layouts: [{{layout: {layout}}}]}}
              - {{kind: debrief, text: debrief}}
            """
        lines = [line.removeprefix(" " * 12) for line in text.strip().splitlines()]
        (folder / "studies" / f"{names[-1]}.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return names


@contextmanager
def server(workspace: Path, database: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A server's URL and process, until the block ends."""
    command = [sys.executable, "-c", "from galley.cli import main; main()", "serve", str(workspace)]
    command += ["--port", "0", "--database", f"sqlite:///{database}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
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


def memory_mib(pid: int) -> float:
    """The most memory that a process has used."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    return int(found[1]) / 1024 if found else 0.0


# ---- the people --------------------------------------------------------------------------------------------


async def press_keys(socket: ClientConnection, rng: random.Random) -> None:
    """Walk here and there and interact, four or five key events a second, until cancelled."""
    seq = itertools.count()

    async def key(name: str, down: bool) -> None:
        message = {
            "type": "key",
            "key": name,
            "down": down,
            "seq": next(seq),
            "client_ms": time.monotonic() * 1e3,
        }
        await socket.send(json.dumps(message))

    while True:
        name = rng.choice(KEYS)
        await key(name, True)
        await asyncio.sleep(rng.uniform(0.08, 0.6))
        await key(name, False)
        if rng.random() < 0.5:
            await key("interact", True)
            await asyncio.sleep(0.08)
            await key("interact", False)
        await asyncio.sleep(rng.uniform(0.05, 0.4))


async def one_person(url: str, study: str, number: int, start_s: float) -> str:
    """Play one round to its end; what went wrong, or an empty text."""
    rng = random.Random(number)
    async with httpx.AsyncClient(base_url=url, follow_redirects=True, timeout=60) as http:
        page = await http.post(f"/s/{study}/begin")
        path = page.url.path
        await http.post(path, data={"step": "consent", "choice": "agree"})
    ticks = 0
    async with connect(url.replace("http", "ws") + f"{path}/play", compression=None) as socket:
        await socket.send(json.dumps({"type": "hello", "protocol": 1, "tab": f"tab {number}"}))
        await asyncio.sleep(max(0.0, start_s - time.time()) + rng.uniform(0.0, 1.0))
        await socket.send(json.dumps({"type": "ready"}))
        typing = asyncio.create_task(press_keys(socket, rng))
        try:
            async for text in socket:
                if '"type":"tick"' in str(text[:16]):
                    ticks += 1
                    if json.loads(text)["tick"] != ticks:
                        return f"round {number}: a tick was lost"
                elif '"type":"ended"' in str(text[:16]):
                    return ""
        finally:
            typing.cancel()
            with suppress(asyncio.CancelledError, Exception):
                await typing
    return f"round {number}: the connection closed after {ticks} ticks"


def people(url: str, jobs: list[tuple[int, str]], start_s: float, found: Any) -> None:
    """A process full of people."""

    async def all_of_them() -> list[str]:
        return await asyncio.gather(*(one_person(url, study, number, start_s) for number, study in jobs))

    found.put(("people", asyncio.run(all_of_them())))


def control(load: Load, start_s: float, found: Any) -> None:
    """A bare timer: the same deadlines, and nothing done at them."""

    async def tick() -> list[float]:
        loop = asyncio.get_running_loop()
        late: list[float] = []
        done = loop.create_future()
        step_s = load.tick_ms / 1000 / load.rounds
        begin_s = loop.time() + max(0.0, start_s + 2.0 - time.time())

        def due(number: int) -> None:
            late.append((loop.time() - begin_s - number * step_s) * 1000)
            if number + 1 < load.ticks * load.rounds:
                loop.call_at(begin_s + (number + 1) * step_s, due, number + 1)
            else:
                done.set_result(None)

        loop.call_at(begin_s, due, 0)
        await done
        return late

    import uvloop

    found.put(("control", uvloop.run(tick())))


# ---- one run -----------------------------------------------------------------------------------------------


def run(load: Load) -> Result:
    """Serve and play one load."""
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory(prefix="galley-rounds-") as name:
        folder = Path(name)
        studies = make_workspace(folder, load)
        database = folder / "records.sqlite"
        with server(folder, database) as (url, process):
            found: Any = context.Queue()
            start_s = time.time() + 3.0 + 0.06 * load.rounds
            jobs = [(number, studies[number % len(studies)]) for number in range(load.rounds)]
            workers = [
                context.Process(target=people, args=(url, jobs[n :: load.clients], start_s, found))
                for n in range(load.clients)
            ]
            workers.append(context.Process(target=control, args=(load, start_s, found)))
            for worker in workers:
                worker.start()
            time.sleep(max(0.0, start_s + 2.0 - time.time()))
            cpu_before, wall_before = cpu_s(process.pid), time.monotonic()
            time.sleep(load.ticks * load.tick_ms / 1000 * 0.8)
            share = (cpu_s(process.pid) - cpu_before) / (time.monotonic() - wall_before)
            answers = [found.get(timeout=load.ticks * load.tick_ms / 1000 + 120) for _ in workers]
            for worker in workers:
                worker.join()
            memory = memory_mib(process.pid)
        return evaluate(load, database, answers, share, memory)


def evaluate(load: Load, database: Path, answers: list[Any], share: float, memory: float) -> Result:
    """Read a run's records."""
    with sqlite3.connect(database) as connection:
        rows = np.array(
            connection.execute(
                "SELECT round_id, tick, deadline_ms, lateness_ms, late FROM ticks ORDER BY round_id, tick"
            ).fetchall(),
            dtype=np.float64,
        ).reshape(-1, 5)
        finished = connection.execute("SELECT count(*) FROM rounds WHERE status = 'finished'").fetchone()[0]
    problems = [problem for kind, told in answers if kind == "people" for problem in told if problem]
    if finished != load.rounds:
        problems.append(f"{load.rounds} rounds began, {finished} finished")
    counts, drift = [], 0.0
    for number in np.unique(rows[:, 0]):
        own = rows[rows[:, 0] == number]
        counts.append(len(own))
        due = own[0, 2] + own[:, 1] * load.tick_ms
        drift = max(drift, float(np.abs(own[:, 2] - due).max()))
    bare = np.array(next(late for kind, late in answers if kind == "control"))
    return Result(rows[:, 3], rows[:, 4], counts, drift, bare, share, memory, problems)


def figures(load: Load, result: Result) -> list[tuple[str, float, str]]:
    """(name, value, unit) of everything worth knowing about a run."""
    p50, p99 = np.percentile(result.lateness, [50, 99]) if len(result.lateness) else (np.nan, np.nan)
    bare50, bare99 = np.percentile(result.control, [50, 99])
    return [
        ("rounds", load.rounds, "rounds"),
        ("tick lateness p50", p50, "ms"),
        ("tick lateness p99", p99, "ms"),
        ("tick lateness max", float(result.lateness.max(initial=0.0)), "ms"),
        ("control lateness p50", bare50, "ms"),
        ("control lateness p99", bare99, "ms"),
        ("control lateness max", float(result.control.max()), "ms"),
        ("fewest ticks of a round", min(result.counts, default=0), "ticks"),
        ("most ticks of a round", max(result.counts, default=0), "ticks"),
        ("drift of deadlines", result.drift_ms, "ms"),
        ("late agents", float(result.late.mean() * 100) if len(result.late) else np.nan, "% of ticks"),
        ("server processor use", result.server_cpu * 100, "% of a core"),
        ("server memory, most", result.server_mib, "MiB"),
    ]


def main() -> int:
    """Run, repeat what does not count, print the figures; 1 when a tick was lost."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=50)
    parser.add_argument("--ticks", type=int, default=400)
    parser.add_argument("--tick-ms", type=int, default=150)
    parser.add_argument("--clients", type=int, default=1, help="processes that play")
    parser.add_argument("--tries", type=int, default=3, help="runs at most, when the control is late")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    load = Load(options.rounds, options.ticks, options.tick_ms, options.clients)
    command = " ".join(["python benchmarks/rounds.py", *sys.argv[1:]])
    for attempt in range(1, options.tries + 1):
        result = run(load)
        counts = bool(np.percentile(result.control, 99) <= CONTROL_P99_MS)
        table = [
            *figures(load, result),
            ("run counts", int(counts), "1 yes, 0 repeat it: the control was late"),
        ]
        for name, value, unit in table:
            if options.json:
                print(json.dumps({"name": name, "value": round(value, 3), "unit": unit, "command": command}))
            else:
                print(f"{name:26} {value:10.2f}  {unit}")
        for problem in result.problems:
            print(problem, file=sys.stderr)
        if counts or result.problems:
            break
        print(
            f"run {attempt} of at most {options.tries} does not count: the control was late", file=sys.stderr
        )
    whole = result.counts == [load.ticks] * load.rounds
    return 0 if whole and not result.problems else 1


if __name__ == "__main__":
    sys.exit(main())
