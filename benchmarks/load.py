"""How many rounds one machine can play at once, with the field's convolutional network as partner.

A server in its own process serves rounds on the five layouts; the partner of each is a network of the shape
used in the field on the `grid` observation, with random weights. People, bare timer and lateness are those of
`live_rounds.py`.

    python benchmarks/load.py --rounds 500
    python benchmarks/load.py --curve 10,50,100,200,300,400,500,600 --markdown

Source of the network: Carroll et al. 2019 (NeurIPS), App. C: three convolutions of 25 filters (5x5, 3x3, 3x3,
the last without padding), three dense layers, here of 64 as in the COLE paper (App. C), leaky ReLU.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from live_rounds import CONTROL_P99_MS, ROOT, Load, Run, play, study_text
from onnx import TensorProto, helper, numpy_helper

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


def make_workspace(folder: Path, load: Load) -> list[str]:
    """A workspace with the partner and one study a layout, each a single round; the studies' names."""
    for part in ("layouts", "questionnaires"):
        shutil.copytree(ROOT / part, folder / part)
    cook = folder / "agents" / "cnn"
    cook.mkdir(parents=True)
    lines = ["format: 1", "name: cnn", "kind: network", "encoding: grid", "sampling: sample"]
    lines += ["unstuck_after_ticks: 3", "layouts:"]
    for number, (layout, (width, height)) in enumerate(SIZES.items()):
        (cook / f"{layout}.onnx").write_bytes(network(width, height, number))
        lines.append(f"  {layout}: {layout}.onnx")
    (cook / "agent.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "studies").mkdir()
    names = [layout.replace("_", "-") for layout in SIZES]
    for name, layout in zip(names, SIZES, strict=True):
        text = study_text(load, "cnn", layout, seed=1)
        (folder / "studies" / f"{name}.yaml").write_text(text, encoding="utf-8")
    return names


# ---- one run -----------------------------------------------------------------------------------------------


def profiled(load: Load, profile: Path | None) -> Run:
    """One load; with `profile`, py-spy writes there what the server was at."""
    spies: list[subprocess.Popen[bytes]] = []

    def spy(pid: int, length_s: float, _url: str) -> None:
        command = [str(Path(sys.executable).with_name("py-spy")), "record", "--pid", str(pid), "--threads"]
        command += ["--rate", "200", "--duration", str(max(1, int(length_s * 0.6)))]
        command += ["--format", "raw", "--output", str(profile)]
        spies.append(subprocess.Popen(command, stdout=subprocess.DEVNULL))

    run = play(load, make_workspace) if profile is None else play(load, make_workspace, spy)
    for one in spies:
        one.wait()
    return run


def figures(run: Run) -> dict[str, tuple[float, str]]:
    """What a run gave: (value, unit) by name."""
    decided = run.ticks[~np.isnan(run.ticks[:, 5]), 5]
    think50, think99 = np.percentile(decided, [50, 99]) if len(decided) else (np.nan, np.nan)
    load, ticks = run.load, len(run.ticks)
    return {
        "rounds": (load.rounds, "rounds"),
        "tick lateness p50": (run.lateness(50), "ms"),
        "tick lateness p99": (run.lateness(99), "ms"),
        "tick lateness max": (run.lateness(100), "ms"),
        "control lateness p50": (run.control_lateness(50), "ms"),
        "control lateness p99": (run.control_lateness(99), "ms"),
        "lost ticks": (load.rounds * load.ticks - ticks, "ticks"),
        "late decisions": (float(run.ticks[:, 4].mean() * 100) if ticks else np.nan, "% of ticks"),
        "decision time p50": (think50, "ms"),
        "decision time p99": (think99, "ms"),
        "problems": (len(run.problems), "rounds"),
        "server processor use": (run.server_share * 100, "% of a core"),
        "people processor use": (run.people_share * 100, "% of a core"),
        "server memory, idle": (run.idle_mib, "MiB"),
        "server memory, playing": (run.playing_mib, "MiB"),
        "server memory, most": (run.most_mib, "MiB"),
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
    "people processor use": "people CPU",
    "server memory, playing": "server memory",
}
UNITS = ("", *(" ms",) * 4, "", " %", " ms", " %", " %", " MiB")


def table(runs: list[dict[str, tuple[float, str]]]) -> str:
    """The runs as Markdown, a row each."""
    lines = ["| " + " | ".join(COLUMNS.values()) + " |", "|" + "---:|" * len(COLUMNS)]
    for one in runs:
        cells = [
            f"{one[name][0]:.{1 if unit == ' ms' or name == 'late decisions' else 0}f}{unit}"
            for name, unit in zip(COLUMNS, UNITS, strict=True)
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
        run = profiled(Load(size, options.ticks, options.tick_ms, options.clients), options.profile)
        done = figures(run)
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
        for problem in run.problems[:5]:
            print(problem, file=sys.stderr)
        if done["tick lateness p99"][0] > 2 * BAR_P99_MS:
            break
    if options.markdown:
        print(table(runs))
    return 0 if all(one["lost ticks"][0] == 0 and one["problems"][0] == 0 for one in runs) else 1


if __name__ == "__main__":
    sys.exit(main())
