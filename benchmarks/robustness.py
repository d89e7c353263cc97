"""How far the measures of a kitchen hold when the human errs: the harness of Table I of the LSI paper.

    python benchmarks/robustness.py              a table
    python benchmarks/robustness.py --json       one JSON object a figure: name, value, unit, command
    python benchmarks/robustness.py --first 200  the same for the 60 kitchens of seeds 200 to 259

On 60 seeded random kitchens, those of seeds 0 to 59, a QMDP robot and a myopic human cook 200 trials of
100 ticks (two onion orders). The medians of each measure without noise place the kitchens; then all is run
again with other seeds at each epsilon. A figure is Spearman's rank correlation of both, its 95% interval from
2,000 bootstrap samples of kitchens, and its p value times the 25 tests (Bonferroni).

Source: Fontaine et al. 2021 (RSS), Sec. VI and Table I.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from scipy.stats import rankdata, spearmanr

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.random_kitchens import random_kitchen  # noqa: E402
from galley.evaluation.teams import Team, evaluate  # noqa: E402
from galley.kitchen import Layout  # noqa: E402

KITCHENS = 60
TRIALS = 200
EPSILONS = (0.0, 0.05, 0.1, 0.2, 0.5)
MEASURES = (
    "ingredients_difference",
    "dishes_difference",
    "served_difference",
    "concurrent_share",
    "stuck_ticks",
)
SAMPLES = 2000


def medians(kitchens: list[Layout], epsilon: float, seed: int, trials: int) -> dict[str, np.ndarray]:
    """The median of each measure in each kitchen, float64 [KITCHENS]."""
    team = Team(epsilon=epsilon, seed=seed, trials=trials)
    found = [evaluate(kitchen, team)["measures"] for kitchen in kitchens]
    return {name: np.array([one[name]["median"] for one in found]) for name in MEASURES}


def correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Spearman's rho, 0 where all of a side are equal."""
    ranks = [rankdata(side) - (len(side) + 1) / 2 for side in (one, other)]
    norm = float(np.sqrt((ranks[0] ** 2).sum() * (ranks[1] ** 2).sum()))
    return float((ranks[0] * ranks[1]).sum()) / norm if norm else 0.0


def main() -> None:
    """Print every correlation, and a line on stderr where more noise does not mean less correlation."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--first", type=int, default=0, help="the seed of the first kitchen")
    parser.add_argument("--trials", type=int, default=TRIALS, help="trials in each kitchen")
    options = parser.parse_args()
    as_json = options.json
    command = f"python benchmarks/robustness.py --first {options.first} --trials {options.trials}"
    kitchens = [random_kitchen(options.first + number) for number in range(KITCHENS)]
    placed = medians(kitchens, 0.0, 0, options.trials)
    random = np.random.default_rng(0)
    samples = random.integers(KITCHENS, size=(SAMPLES, KITCHENS))
    rho: dict[tuple[str, float], float] = {}
    if not as_json:
        print(f"{'epsilon':8}" + "".join(f"{name:>36}" for name in MEASURES))
    for number, epsilon in enumerate(EPSILONS):
        noisy = medians(kitchens, epsilon, 1 + number, options.trials)
        row = f"{epsilon:<8}"
        for name in MEASURES:
            value = correlation(placed[name], noisy[name])
            low, high = np.quantile(
                [correlation(placed[name][sample], noisy[name][sample]) for sample in samples], (0.025, 0.975)
            )
            p = min(1.0, float(spearmanr(placed[name], noisy[name]).pvalue) * len(EPSILONS) * len(MEASURES))
            rho[name, epsilon] = value
            row += f"{f'{value:.2f} [{low:.2f}, {high:.2f}] p {p:.1g}':>36}"
            if as_json:
                figure = {
                    "name": f"rho {name} epsilon {epsilon}", "value": round(value, 4),
                    "unit": "Spearman's rho", "low": round(float(low), 4), "high": round(float(high), 4),
                    "p": p, "command": command,
                }  # fmt: skip
                print(json.dumps(figure))
        if not as_json:
            print(row)
    wrong = [name for name in MEASURES if not rho[name, 0.0] > rho[name, 0.2] > rho[name, 0.5]]
    if wrong:
        print(f"more noise does not mean less correlation in {', '.join(wrong)}", file=sys.stderr)


if __name__ == "__main__":
    main()
