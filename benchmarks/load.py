"""How many rounds one machine can play at once, with the field's convolutional network as partner.

A server in its own process serves rounds on the five layouts; the partner of each is a network of the shape
used in the field on the `grid` observation, with random weights. Clients share as few processes as asked for;
they read frames without parsing them and press keys as people do. Lateness is what the server recorded of
every tick: when its frame was handed to the socket, minus its deadline. Beside it a bare timer keeps as many
deadlines in a process of its own: what is late there, the machine is late with.

    python benchmarks/load.py --rounds 500
    python benchmarks/load.py --curve 10,50,100,200,300,400,500,600 --markdown

Source of the network: Carroll et al. 2019 (NeurIPS), App. C: three convolutions of 25 filters (5x5, 3x3, 3x3,
the last without padding), three dense layers, here of 64 as in the COLE paper (App. C), leaky ReLU.
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
import urllib.parse
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import uvloop
from onnx import TensorProto, helper, numpy_helper
from websockets.asyncio.client import ClientConnection, connect

ROOT = Path(__file__).resolve().parents[1]
SIZES = {
    "cramped_room": (5, 4),
    "asymmetric_advantages": (9, 5),
    "coordination_ring": (5, 5),
    "forced_coordination": (5, 5),
    "counter_circuit": (8, 5),
}
"""Width and height of the layouts played."""
CHANNELS, FILTERS, DENSE, ACTIONS = 26, 25, 64, 6
LEAK = 0.2
BAR_P99_MS = 25.0
CONTROL_P99_MS = 5.0
KEYS = ("up", "down", "left", "right")
BEGIN_AT_ONCE = 8


# ---- the partner -------------------------------------------------------------------------------------------


def network(width: int, height: int, seed: int) -> bytes:
    """An ONNX file of the network for one map: `observation` [B, 26, H, W] to `logits` [B, 6]."""
    rng = np.random.default_rng(seed)
    weights: list[onnx.TensorProto] = []
    nodes: list[onnx.NodeProto] = []

    def layer(
        kind: str, before: str, after: str, shape: tuple[int, ...], last: bool = False, **more: Any
    ) -> None:
        fan_in = int(np.prod(shape[1:])) if kind == "Conv" else shape[0]
        values = {
            "w": rng.normal(size=shape) * np.sqrt(2 / fan_in),
            "b": np.zeros(shape[0 if kind == "Conv" else 1]),
        }
        names = [f"{after}_{part}" for part in values]
        for name, value in zip(names, values.values(), strict=True):
            weights.append(numpy_helper.from_array(value.astype(np.float32), name))
        made = after if last else f"{after}_linear"
        nodes.append(helper.make_node(kind, [before, *names], [made], **more))
        if not last:
            nodes.append(helper.make_node("LeakyRelu", [made], [after], alpha=LEAK))

    layer("Conv", "observation", "c1", (FILTERS, CHANNELS, 5, 5), pads=[2, 2, 2, 2])
    layer("Conv", "c1", "c2", (FILTERS, FILTERS, 3, 3), pads=[1, 1, 1, 1])
    layer("Conv", "c2", "c3", (FILTERS, FILTERS, 3, 3))
    nodes.append(helper.make_node("Flatten", ["c3"], ["flat"]))
    layer("Gemm", "flat", "d1", (FILTERS * (width - 2) * (height - 2), DENSE))
    layer("Gemm", "d1", "d2", (DENSE, DENSE))
    layer("Gemm", "d2", "d3", (DENSE, DENSE))
    layer("Gemm", "d3", "logits", (DENSE, ACTIONS), last=True)
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["B", CHANNELS, height, width])],
        [helper.make_tensor_value_info("logits", TensorProto.FLOAT, ["B", ACTIONS])],
        weights,
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    onnx.checker.check_model(made)
    return bytes(made.SerializeToString())


# ---- the server --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Load:
    """What to run."""

    rounds: int
    ticks: int
    tick_ms: int
    clients: int


def make_workspace(folder: Path, load: Load) -> list[str]:
    """A workspace with the partner and one study a layout, each a single round; the studies' names."""
    for part in ("layouts", "agents", "questionnaires"):
        shutil.copytree(ROOT / part, folder / part)
    cook = folder / "agents" / "cnn"
    cook.mkdir()
    lines = ["format: 1", "name: cnn", "kind: network", "encoding: grid", "sampling: sample"]
    lines += ["unstuck_after_ticks: 3", "layouts:"]
    for number, (layout, (width, height)) in enumerate(SIZES.items()):
        (cook / f"{layout}.onnx").write_bytes(network(width, height, number))
        lines.append(f"  {layout}: {layout}.onnx")
    (cook / "agent.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "studies").mkdir()
    for layout in SIZES:
        text = f"""format: 1
title: Load
seed: 1
tick_ms: {load.tick_ms}
horizon_ticks: {load.ticks}
countdown_s: 1
completion: {{code: DONE}}
stages:
  - {{kind: consent, text: consent}}
  - {{kind: rounds, agents: [cnn], layouts: [{{layout: {layout}}}]}}
  - {{kind: debrief, text: debrief}}
"""
        (folder / "studies" / f"{layout.replace('_', '-')}.yaml").write_text(text, encoding="utf-8")
    return [layout.replace("_", "-") for layout in SIZES]


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


def memory_mib(pid: int, field: str) -> float:
    """Memory of a process: VmRSS now, VmHWM the most so far."""
    found = re.search(rf"{field}:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    return int(found[1]) / 1024 if found else 0.0


# ---- the people --------------------------------------------------------------------------------------------


def begin(url: str, study: str) -> str:
    """The path of a new visit that has come to its round."""
    with urllib.request.urlopen(
        urllib.request.Request(f"{url}/s/{study}/begin", method="POST", data=b"")
    ) as page:
        path = urllib.parse.urlsplit(page.url).path
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


async def one_person(url: str, path: str, number: int, ready: asyncio.Event, load: Load) -> str:
    """Play one round to its end; what went wrong, or an empty text."""
    rng = random.Random(number)
    ticks = 0
    try:
        async with connect(
            url.replace("http", "ws") + f"{path}/play", compression=None, ping_interval=None, max_queue=None,
            open_timeout=60,
        ) as socket:  # fmt: skip
            await socket.send(f'{{"type":"hello","protocol":1,"tab":"tab {number}"}}')
            await ready.wait()
            await asyncio.sleep(rng.uniform(0.0, 2.0))
            await socket.send('{"type":"ready"}')
            typing = asyncio.create_task(press_keys(socket, rng))
            try:
                async for frame in socket:
                    start = frame[:15]
                    if start == '{"type":"tick",':
                        ticks += 1
                    elif start == '{"type":"ended"':
                        return "" if ticks == load.ticks else f"round {number}: {ticks} ticks were seen"
            finally:
                typing.cancel()
                with suppress(asyncio.CancelledError, Exception):
                    await typing
    except Exception as error:
        return f"round {number}: {type(error).__name__} after {ticks} ticks: {error}"
    return f"round {number}: the connection closed after {ticks} ticks"


def people(url: str, jobs: list[tuple[int, str]], load: Load, here: Any, go: Any, found: Any) -> None:
    """A process full of people: all begin, tell that they are there, and play when told to."""

    async def all_of_them() -> list[str]:
        ready, places = asyncio.Event(), asyncio.Semaphore(BEGIN_AT_ONCE)

        async def arrive(study: str) -> str:
            async with places:
                return await asyncio.to_thread(begin, url, study)

        paths = await asyncio.gather(*(arrive(study) for _, study in jobs))
        playing = []
        for (number, _), path in zip(jobs, paths, strict=True):
            playing.append(asyncio.create_task(one_person(url, path, number, ready, load)))
            await asyncio.sleep(0.01)
        await asyncio.sleep(1.0)
        here.put(len(jobs))
        await asyncio.to_thread(go.wait)
        ready.set()
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
        begin_s = loop.time() + 2.0

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


def run(load: Load, profile: Path | None = None) -> dict[str, Any]:
    """The figures of one load; with `profile`, py-spy writes there what the server was at."""
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory(prefix="galley-load-") as name:
        folder = Path(name)
        studies = make_workspace(folder, load)
        database = folder / "records.sqlite"
        with server(folder, database) as (url, process):
            before_mib = memory_mib(process.pid, "VmRSS")
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
            time.sleep(4.0)
            cpu, wall = cpu_s(process.pid), time.monotonic()
            length_s = load.ticks * load.tick_ms / 1000
            spying = None
            if profile is not None:
                spy = [str(Path(sys.executable).with_name("py-spy")), "record", "--pid", str(process.pid)]
                spy += [
                    "--duration",
                    str(max(1, int(length_s * 0.6))),
                    "--format",
                    "raw",
                    "--output",
                    str(profile),
                ]
                spying = subprocess.Popen([*spy, "--rate", "200", "--threads"], stdout=subprocess.DEVNULL)
            time.sleep(length_s * 0.7)
            share = (cpu_s(process.pid) - cpu) / (time.monotonic() - wall)
            now_mib = memory_mib(process.pid, "VmRSS")
            answers = [found.get(timeout=length_s + 120) for _ in workers]
            for worker in [*workers]:
                worker.join()
            if spying is not None:
                spying.wait()
            most_mib = memory_mib(process.pid, "VmHWM")
        return figures(load, database, answers) | {
            "server processor use": (share * 100, "% of a core"),
            "server memory, idle": (before_mib, "MiB"),
            "server memory, playing": (now_mib, "MiB"),
            "server memory, most": (most_mib, "MiB"),
        }


def figures(load: Load, database: Path, answers: list[Any]) -> dict[str, Any]:
    """What the records and the people say: (value, unit) by name, and problems."""
    with sqlite3.connect(database) as connection:
        rows = np.array(
            connection.execute("SELECT round_id, lateness_ms, late, decision_ms FROM ticks").fetchall(),
            dtype=np.float64,
        ).reshape(-1, 4)
        finished = connection.execute("SELECT count(*) FROM rounds WHERE status = 'finished'").fetchone()[0]
    problems = [problem for kind, told in answers if kind == "people" for problem in told if problem]
    if finished != load.rounds:
        problems.append(f"{load.rounds} rounds began, {finished} finished")
    bare = np.array(next(late for kind, late in answers if kind == "control"))
    late50, late99 = np.percentile(rows[:, 1], [50, 99]) if len(rows) else (np.nan, np.nan)
    decided = rows[~np.isnan(rows[:, 3]), 3]
    think50, think99 = np.percentile(decided, [50, 99]) if len(decided) else (np.nan, np.nan)
    return {
        "rounds": (load.rounds, "rounds"),
        "tick lateness p50": (late50, "ms"),
        "tick lateness p99": (late99, "ms"),
        "tick lateness max": (float(rows[:, 1].max(initial=0.0)), "ms"),
        "control lateness p50": (float(np.percentile(bare, 50)), "ms"),
        "control lateness p99": (float(np.percentile(bare, 99)), "ms"),
        "lost ticks": (load.rounds * load.ticks - len(rows), "ticks"),
        "late decisions": (float(rows[:, 2].mean() * 100) if len(rows) else np.nan, "% of ticks"),
        "decision time p50": (think50, "ms"),
        "decision time p99": (think99, "ms"),
        "problems": (len(problems), "rounds"),
        "told": problems[:5],
    }


COLUMNS = {
    "rounds": "rounds",
    "tick lateness p50": "late p50",
    "tick lateness p99": "late p99",
    "tick lateness max": "late max",
    "control lateness p99": "bare timer p99",
    "lost ticks": "lost ticks",
    "late decisions": "late decisions",
    "decision time p99": "decision p99",
    "server processor use": "server CPU",
    "server memory, playing": "server memory",
}


def table(runs: list[dict[str, Any]]) -> str:
    """The runs as Markdown, a row each."""
    units = ["", *(" ms",) * 4, "", " %", " ms", " %", " MiB"]
    lines = ["| " + " | ".join(COLUMNS.values()) + " |", "|" + "---:|" * len(COLUMNS)]
    for one in runs:
        cells = [
            f"{one[name][0]:.0f}{unit}"
            if unit in ("", " %", " MiB") and name != "late decisions"
            else f"{one[name][0]:.2f}{unit}"
            for name, unit in zip(COLUMNS, units, strict=True)
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> int:
    """Run every load, print the figures; 1 when a tick was lost or a round went wrong."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=100)
    parser.add_argument(
        "--curve", help="several loads, such as 10,50,100; ends at the first beyond twice the bar"
    )
    parser.add_argument("--ticks", type=int, default=200)
    parser.add_argument("--tick-ms", type=int, default=150)
    parser.add_argument("--clients", type=int, default=1, help="processes that play")
    parser.add_argument("--profile", type=Path, help="file for py-spy's stacks of the last load")
    parser.add_argument("--markdown", action="store_true", help="a table at the end")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    command = " ".join(["python benchmarks/load.py", *sys.argv[1:]])
    sizes = [int(size) for size in options.curve.split(",")] if options.curve else [options.rounds]
    runs = []
    for size in sizes:
        done = run(Load(size, options.ticks, options.tick_ms, options.clients), options.profile)
        told = done.pop("told")
        runs.append(done)
        for name, (value, unit) in done.items():
            if options.json:
                shown = {
                    "name": name,
                    "value": round(float(value), 3),
                    "unit": unit,
                    "rounds": size,
                    "command": command,
                }
                print(json.dumps(shown), flush=True)
            else:
                print(f"{name:26} {value:10.2f}  {unit}", flush=True)
        if done["control lateness p99"][0] > CONTROL_P99_MS:
            print(
                f"{size} rounds: the bare timer was late too: the machine is busy with other things",
                file=sys.stderr,
            )
        for problem in told:
            print(problem, file=sys.stderr)
        if done["tick lateness p99"][0] > 2 * BAR_P99_MS:
            break
    if options.markdown:
        print(table(runs))
    return 0 if all(one["lost ticks"][0] == 0 and one["problems"][0] == 0 for one in runs) else 1


if __name__ == "__main__":
    sys.exit(main())
