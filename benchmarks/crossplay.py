"""What evaluations and COLE's solvers cost on one core.

    python benchmarks/crossplay.py          one line a figure
    python benchmarks/crossplay.py --json   one JSON object a figure: name, value, unit, command

A cell is 200 games of 400 ticks on Counter Circuit in one seat order: of the shipped clones with each other,
and of the paper's network (random weights, `grid` observations) with itself, as it is and with its channels
filled up (`galley.learning.bundles.filled_convolutions`).
Solvers run on a population of 50. Times are processor times of
this process, the best of three; kernels are compiled before.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from galley.agents.bundle import Bundle, load_bundle  # noqa: E402
from galley.agents.episode import play_episodes  # noqa: E402
from galley.evaluation.game_graph import centrality_matrix, graphic_shapley  # noqa: E402
from galley.kitchen import Encoder, Layout  # noqa: E402
from galley.kitchen.layout_file import load_layout  # noqa: E402
from galley.learning.bundles.filled_convolutions import filled  # noqa: E402
from tests.agents.admission.newcomers import cole_policy  # noqa: E402

COMMAND = "python benchmarks/crossplay.py"
GAMES = 200
STRATEGIES = 50
DESCRIPTION = """\
format: 1
name: cnn
kind: network
encoding: grid
sampling: sample
unstuck_after_ticks: none
layouts:
  counter_circuit: counter_circuit.onnx
"""


def best_s(work: Callable[[], object]) -> float:
    """The least processor seconds of three runs."""
    times = []
    for _ in range(3):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def cell_s(seats: tuple[Bundle, Bundle], layout: Layout) -> float:
    """Processor seconds of one cell."""
    play_episodes(layout, seats, [0])
    return best_s(lambda: play_episodes(layout, seats, list(range(GAMES))))


def network(folder: Path, content: bytes) -> Bundle:
    """A bundle of a network."""
    place = folder / "cnn"
    place.mkdir()
    (place / "counter_circuit.onnx").write_bytes(content)
    (place / "agent.yaml").write_text(DESCRIPTION, "utf-8")
    return load_bundle(place, "cnn")


def figures() -> Iterator[tuple[str, float, str]]:
    """Each figure as (name, value, unit)."""
    layout = load_layout(ROOT / "layouts" / "counter_circuit.yaml")
    clones = [load_bundle(ROOT / "agents" / name, name) for name in ("human-bc", "human-proxy")]
    yield "a cell of 200 games, clones", cell_s((clones[0], clones[1]), layout), "s"
    plain = cole_policy(Encoder(layout, "grid").shape)
    for told, content in (("the paper's network", plain), ("the same, filled", filled(plain))):
        with tempfile.TemporaryDirectory() as folder:
            chef = network(Path(folder), content)
            yield f"a cell of 200 games, {told}", cell_s((chef, chef), layout), "s"
    scores = np.random.default_rng(1).uniform(0, 200, (STRATEGIES, STRATEGIES))
    payoffs = (scores + scores.T) / 2
    generator = np.random.default_rng(2)
    graphic_shapley(payoffs, 1, generator)
    for count in (1_000, 10_000):
        taken = best_s(lambda count=count: graphic_shapley(payoffs, count, generator))  # type: ignore[misc]
        yield f"graphic Shapley of 50, {count:,} permutations", 1000 * taken, "ms"
    yield "graphic Shapley of 50, exact", 1000 * best_s(lambda: graphic_shapley(payoffs, 0, generator)), "ms"
    yield "centrality matrix of 50", 1000 * best_s(lambda: centrality_matrix(payoffs)), "ms"


def main() -> None:
    """Print every figure."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", action="store_true")
    as_json = parser.parse_args().json
    for name, value, unit in figures():
        if as_json:
            print(json.dumps({"name": name, "value": value, "unit": unit, "command": COMMAND}))
        else:
            print(f"{name:50} {value:8.3f} {unit}")


if __name__ == "__main__":
    main()
