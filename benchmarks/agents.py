"""What decisions of network agents cost: the paper's network, 500 rounds on a kitchen of 8 x 5 tiles.

    python benchmarks/agents.py          one line a figure
    python benchmarks/agents.py --json   one JSON object a figure: name, value, unit, command

The network is that of Li et al. 2023 (COLE) on `grid` observations with random weights; actions are sampled
and the unstuck rule is on. Costs are processor time of the deciding thread, the best of the repeats that fit
into some seconds; waiting times under load are wall time, with two busy processes for each core beside it.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from galley.agents.agent_batch import act_all  # noqa: E402
from galley.agents.choosing import choose  # noqa: E402
from galley.agents.network import Network, NetworkAgent  # noqa: E402
from galley.compiled.randomness import uniform  # noqa: E402
from galley.kitchen import Encoder, KitchenBatch, Layout  # noqa: E402
from galley.kitchen.layout_file import load_layout  # noqa: E402
from tests.agents.admission.newcomers import cole_policy  # noqa: E402

LAYOUT = "counter_circuit"
ROUNDS = 500
TICKS_PER_S = 1000 / 150
BATCHES = (1, 4, 16, 64, 500)
SAME_BATCHES = (*range(1, 34), 64, 65, 127, 250, 500)
SAME_TICKS = 20
SPAN_S = 2.0
BUSY = "while True: pass"


class Rounds:
    """500 rounds at once, every agent's kitchen at another state."""

    def __init__(self, layout: Layout, folder: Path) -> None:
        self.encoder = Encoder(layout, "grid")
        path = folder / "policy.onnx"
        path.write_bytes(cole_policy(self.encoder.shape))
        self.network = Network(path, self.encoder.shape)
        self.kitchens = KitchenBatch(layout, ROUNDS)
        self.agents = [
            NetworkAgent(lambda _: (self.network, self.encoder), "sample", 3) for _ in range(ROUNDS)
        ]
        for number, agent in enumerate(self.agents):
            agent.reset(layout, number % 2, number)
        self.tick = 0
        for _ in range(60):
            self.step(self.decide(ROUNDS))

    def decide(self, batch: int) -> list[int]:
        """The actions of all, asked `batch` at a time."""
        states = list(self.kitchens.states.copy())
        actions: list[int] = []
        for start in range(0, ROUNDS, batch):
            some = slice(start, start + batch)
            agents = self.agents[some]
            actions += act_all(agents, states[some], [self.tick] * len(agents))
        return actions

    def step(self, actions: list[int]) -> None:
        """One tick; the other chefs walk at random."""
        others = np.random.default_rng(self.tick).integers(0, 6, ROUNDS)
        joint = np.stack([actions, others], axis=1).astype(np.uint8)
        joint[1::2] = joint[1::2, ::-1]
        states = self.kitchens.states.copy()
        for agent, state, (one, other) in zip(self.agents, states, joint.tolist(), strict=True):
            agent.observe(state, (one, other))
        self.kitchens.step(joint)
        self.tick += 1


def cost_us(run: Callable[[], object], decisions: int) -> float:
    """Processor time of one decision in µs."""
    times: list[float] = []
    begin = time.perf_counter()
    while len(times) < 3 or time.perf_counter() - begin < SPAN_S:
        start = time.thread_time()
        run()
        times.append(time.thread_time() - start)
    return 1e6 * min(times) / decisions


def parts(rounds: Rounds) -> Iterator[tuple[str, float, str]]:
    """What encoding, network and choosing take of a decision in a batch of all."""
    states = rounds.kitchens.states.copy()
    seats = np.arange(ROUNDS) % 2
    numbers = np.arange(ROUNDS, dtype=np.uint64)
    seen = rounds.encoder.seat(states, seats).astype(np.float32)
    logits, _ = rounds.network.run(seen)
    barred = np.zeros(logits.shape, dtype=np.bool_)

    def chosen() -> NDArray[np.int64]:
        return choose(logits, barred, uniform(numbers, seats, seats))

    for name, run in (
        ("encode", lambda: rounds.encoder.seat(states, seats).astype(np.float32)),
        ("network", lambda: rounds.network.run(seen)),
        ("choose", chosen),
    ):
        yield f"{name}, of a decision in a batch of {ROUNDS}", cost_us(run, ROUNDS), "µs"


def differing(rounds: Rounds) -> tuple[int, int]:
    """Actions that hang on the size of the batch, and how many were compared."""
    wrong = compared = 0
    for _ in range(SAME_TICKS):
        wanted = rounds.decide(ROUNDS)
        for batch in SAME_BATCHES:
            wrong += sum(one != other for one, other in zip(rounds.decide(batch), wanted, strict=True))
            compared += ROUNDS
        rounds.step(wanted)
    return wrong, compared


def waits_ms(rounds: Rounds, batch: int) -> NDArray[np.float64]:
    """Wall times of a batch in ms while every core is busy twice over."""
    busy = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(2 * (os.cpu_count() or 1))]
    states = list(rounds.kitchens.states.copy())[:batch]
    times: list[float] = []
    try:
        begin = time.perf_counter()
        while time.perf_counter() - begin < 4 * SPAN_S:
            time.sleep(0.005)
            start = time.perf_counter()
            act_all(rounds.agents[:batch], states, [rounds.tick] * batch)
            times.append(1000 * (time.perf_counter() - start))
    finally:
        for process in busy:
            process.kill()
            process.wait()
    return np.array(times)


def figures() -> Iterator[tuple[str, float, str]]:
    """Name, value and unit of each figure."""
    layout = load_layout(ROOT / "layouts" / f"{LAYOUT}.yaml").with_rules(horizon_ticks=10_000)
    with tempfile.TemporaryDirectory() as folder:
        rounds = Rounds(layout, Path(folder))
        for batch in BATCHES:
            each = cost_us(lambda batch=batch: rounds.decide(batch), ROUNDS)
            yield f"decision in batches of {batch}", each, "µs"
            share = each * 1e-6 * ROUNDS * TICKS_PER_S
            yield f"{ROUNDS} rounds, decisions in batches of {batch}", share, "cores"
        yield from parts(rounds)
        wrong, compared = differing(rounds)
        yield f"actions that hang on the batch, of {compared}", float(wrong), "actions"
        for batch in (1, 32):
            waits = waits_ms(rounds, batch)
            for share_of in (50, 99):
                name = f"{share_of}th percentile of a batch of {batch} on a busy machine"
                yield name, float(np.percentile(waits, share_of)), "ms"


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description="What decisions of network agents cost.")
    parser.add_argument("--json", action="store_true", help="one JSON object a figure")
    wanted = parser.parse_args()
    command = f"python benchmarks/agents.py{' --json' if wanted.json else ''}"
    for name, value, unit in figures():
        row = {"name": name, "value": round(value, 4), "unit": unit, "command": command}
        print(json.dumps(row) if wanted.json else f"{name:55} {value:10.3f} {unit}", flush=True)


if __name__ == "__main__":
    main()
