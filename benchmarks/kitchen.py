"""How fast kitchens run on one core, beside the overcooked-ai 1.1.0 package in the same run.

    python benchmarks/kitchen.py          one line a figure
    python benchmarks/kitchen.py --json   one JSON object a figure: name, value, unit, command

Every figure is the best of the repeats that fit into some seconds, because other work on the machine can only
make one slower; on a machine whose cores are all busy even the best is too slow.
Actions are random; a batch is 1,024 kitchens; the package is stepped one kitchen at a time, as it is used.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from galley.kitchen import Encoder, Kitchen, KitchenBatch, Layout, warm  # noqa: E402
from galley.kitchen.layout_file import load_layout  # noqa: E402
from tests.overcooked_package import mdp  # noqa: E402

SPAN_S = 3.0
BATCH = 1024
TICKS = 100
LARGE = """
XXXXXPXXXPXXXXX
X             X
O  1   X   2  S
X      X      X
X   XXXX      X
X      X      X
O      X      S
X      X      X
X             X
XXXDXXXXXXXDXXX
"""
IMPORT = """
import time
start = time.perf_counter()
from galley.kitchen import Kitchen, Layout
Kitchen(Layout.from_ascii("first", "XPOX\\nX12X\\nXDSX")).step(4, 4)
print(time.perf_counter() - start)
"""


def best(run: Callable[[], object]) -> float:
    """The shortest in seconds of as many runs as fit into `SPAN_S`, at least three."""
    times: list[float] = []
    while len(times) < 3 or sum(times) < SPAN_S:
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def batch_ticks_per_s(layout: Layout, observed: bool) -> float:
    """Ticks per second of a batch, with both seats' `grid` observations of every tick if `observed`."""
    layout = layout.with_rules(horizon_ticks=TICKS)
    batch = KitchenBatch(layout, BATCH)
    encoder = Encoder(layout, "grid")
    seen = encoder.both(batch.states)
    actions = np.random.default_rng(0).integers(0, 6, (TICKS, BATCH, 2)).astype(np.uint8)

    def run() -> None:
        batch.reset()
        for joint in actions:
            batch.step(joint)
            if observed:
                encoder.both(batch.states, seen)

    return TICKS * BATCH / best(run)


def tick_from_python_us(layout: Layout) -> float:
    """Microseconds of one `Kitchen.step` called from Python."""
    ticks = 20_000
    kitchen = Kitchen(layout.with_rules(horizon_ticks=ticks))
    actions = np.random.default_rng(0).integers(0, 6, (ticks, 2)).tolist()

    def run() -> None:
        kitchen.reset()
        for a0, a1 in actions:
            kitchen.step(a0, a1)

    return best(run) / ticks * 1e6


def import_s() -> float:
    """Seconds that a fresh Python takes to import the kitchen and make its first step, once compiled."""
    runs = [subprocess.run([sys.executable, "-c", IMPORT], capture_output=True, text=True) for _ in range(8)]
    return min(float(done.stdout) for done in runs)


def package_ticks_per_s(layout: Layout, observed: bool) -> float:
    """Ticks per second of the overcooked-ai package, with its lossless observations if `observed`."""
    ticks = 200
    package = mdp()
    orders = [{"ingredients": ["onion"] * 3}]
    world = package.OvercookedGridworld.from_grid(list(layout.grid), {"start_all_orders": orders})
    moves = [(0, -1), (0, 1), (1, 0), (-1, 0), (0, 0), "interact"]
    actions = np.random.default_rng(0).integers(0, 6, (ticks, 2)).tolist()

    def run() -> None:
        state = world.get_standard_start_state()
        for a0, a1 in actions:
            state, _ = world.get_state_transition(state, (moves[a0], moves[a1]))
            if observed:
                world.lossless_state_encoding(state)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return ticks / best(run)


def figures() -> Iterator[tuple[str, float, str, str]]:
    """Each figure as (name, value, unit, bar)."""
    small, ring = (
        load_layout(ROOT / "layouts" / f"{name}.yaml") for name in ("cramped_room", "counter_circuit")
    )
    large = Layout.from_ascii("large", LARGE)
    warm()
    yield "rules only, batch, 5x4", batch_ticks_per_s(small, False), "ticks/s", ">= 10000000"
    for layout, bar in ((small, 2_000_000), (ring, 1_500_000), (large, 500_000)):
        name = f"rules and both grid observations, batch, {layout.width}x{layout.height}"
        yield name, batch_ticks_per_s(layout, True), "ticks/s", f">= {bar}"
    yield "one tick from Python, 5x4", tick_from_python_us(small), "us", "<= 2"
    yield "import and first step, compiled before", import_s(), "s", "< 1"
    yield "overcooked-ai 1.1.0, rules only, 5x4", package_ticks_per_s(small, False), "ticks/s", ""
    yield (
        "overcooked-ai 1.1.0, rules and lossless observations, 5x4",
        package_ticks_per_s(small, True),
        "ticks/s",
        "",
    )


def main() -> None:
    """Nothing; prints the figures as the command line asks."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true", help="one JSON object a figure")
    as_json = parser.parse_args().json
    command = "python benchmarks/kitchen.py" + (" --json" if as_json else "")
    for name, value, unit, bar in figures():
        rounded = round(value) if value >= 100 else float(f"{value:.3g}")
        if as_json:
            print(json.dumps({"name": name, "value": rounded, "unit": unit, "command": command}), flush=True)
        else:
            wanted = f"   (bar {bar})" if bar else ""
            print(f"{name:<62}{rounded:>14,} {unit}{wanted}", flush=True)


if __name__ == "__main__":
    main()
