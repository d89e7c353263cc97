"""How fast policies learn: kitchen, inference and PPO together, as COLE does it at the paper's scale.

    python benchmarks/learning.py                        one line a figure
    python benchmarks/learning.py --json                 one JSON object a figure: name, value, unit, command
    python benchmarks/learning.py --device cuda --bf16   on a GPU

Counter Circuit, the paper's network and constants: updates of 48,000 ticks (120 kitchens), 8 epochs of 10
minibatches, a quarter of the kitchens with itself, three quarters with three partners of a population of 50,
whose payoffs with a new strategy are measured as at the end of each generation. All cores unless `--threads`
says otherwise; the best of the repeats, because other work on the machine can only make one slower.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
import torch  # noqa: E402

from galley.kitchen.layout_file import load_layout  # noqa: E402
from galley.learning.options import TrainingOptions  # noqa: E402
from galley.learning.ppo.forwards import machine_for  # noqa: E402
from galley.learning.ppo.games import games_with  # noqa: E402
from galley.learning.ppo.learner import Learner, kitchens_of  # noqa: E402
from galley.learning.ppo.policy import Policy  # noqa: E402
from galley.learning.ppo.rollout import Episodes, Pairing  # noqa: E402
from galley.learning.ppo.update import update  # noqa: E402
from galley.learning.run_settings import cole_settings, ppo_settings  # noqa: E402
from galley.learning.torch_process import prepare_process  # noqa: E402

LAYOUT = "counter_circuit"
POPULATION = 50


def best(run: Callable[[], object], repeats: int) -> float:
    """The shortest of the repeats in seconds; one more goes before them unmeasured."""
    run()
    times = []
    for _ in range(repeats):
        if torch.cuda.is_available():
            torch.cuda.synchronize()
        start = time.perf_counter()
        run()
        if torch.cuda.is_available():
            torch.cuda.synchronize()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    """Nothing; prints the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--bf16", action="store_true")
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()

    prepare_process()
    layout = load_layout(ROOT / "layouts" / f"{LAYOUT}.yaml")
    options = TrainingOptions("cole-sv", LAYOUT)
    settings, cole = ppo_settings(options)[0], cole_settings(options)
    machine = machine_for(args.device, args.threads, bf16=args.bf16)
    learner = Learner(layout, settings, 100, 0, machine)
    kitchens = kitchens_of(layout, settings)
    episodes = Episodes(layout, kitchens, machine)
    partners = [
        Policy(layout, torch.Generator().manual_seed(number)).to(machine.device).requires_grad_(False)
        for number in range(POPULATION)
    ]
    part = kitchens // sum(cole.ratio)
    pairings = [Pairing(None, part), *(Pairing(partner, part) for partner in partners[:3])]
    rollout = episodes.play(learner.policy, pairings, 0)

    def cook() -> None:
        seen = np.empty((kitchens, *episodes.encoder.shape), dtype=np.uint8)
        actions = np.random.default_rng(0).integers(0, 6, (episodes.horizon, kitchens, 2))
        seats = np.arange(kitchens) % 2
        episodes.batch.reset()
        for joint in actions:
            episodes.encoder.seat(episodes.batch.states, seats, seen)
            episodes.encoder.seat(episodes.batch.states, 1 - seats, seen)
            episodes.batch.step(joint)
            episodes.batch.shaping()

    def learn() -> None:
        update(
            learner.policy, learner.optimiser, rollout, settings,
            progress=0, shaping=1, seed=0, machine=machine,
        )  # fmt: skip

    cooking_s = best(cook, args.repeats)
    playing_s = best(lambda: episodes.play(learner.policy, pairings, 0), args.repeats)
    learning_s = best(learn, args.repeats)
    payoffs_s = best(lambda: games_with(layout, learner.policy, partners, cole.games, 0, machine), 1)
    ticks = kitchens * episodes.horizon
    update_s = playing_s + learning_s
    sizes = [min(number + 1, cole.cap) for number in range(cole.generations)]
    total_s = cole.generations * cole.updates * update_s + payoffs_s * sum(sizes) / cole.cap
    figures = [
        ("ticks per second", ticks / update_s, "1/s"),
        ("share of the kitchen", 100 * cooking_s / update_s, "%"),
        ("share of inference", 100 * (playing_s - cooking_s) / update_s, "%"),
        ("share of learning", 100 * learning_s / update_s, "%"),
        ("rows learned from per second, forward and back", settings.epochs * ticks / learning_s, "1/s"),
        ("payoffs of a strategy with 50 others", payoffs_s, "s"),
        ("updates of all generations", cole.generations * cole.updates * update_s / 60, "min"),
        ("all generations with their payoffs", total_s / 60, "min"),
        ("largest memory", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, "MiB"),
    ]
    where = f"{args.device}{', bf16' if args.bf16 else ''}, {args.threads} threads"
    command = " ".join(["python", "benchmarks/learning.py", *sys.argv[1:]])
    for name, value, unit in figures:
        if args.json:
            print(json.dumps({"name": f"{name}, {where}", "value": value, "unit": unit, "command": command}))
        else:
            print(f"{name:50} {value:12,.1f} {unit}")


if __name__ == "__main__":
    main()
