"""How late ticks are when many rounds are played at once on a real server.

A server in its own process serves rounds with a network agent (human-bc) and a planner (myopic) on all
the classic layouts, or with the agents that `--agents` names. People, bare timer and lateness are those of
`live_rounds.py`: where the timer is late by more than 5 ms at p99, the machine was busy with something else,
and the run is repeated instead of counted.

    python benchmarks/rounds.py
    python benchmarks/rounds.py --rounds 100 --agents human-bc,human-proxy,myopic,random,stay
"""

from __future__ import annotations

import argparse
import itertools
import json
import shutil
import sys
from functools import partial
from pathlib import Path

import numpy as np
from live_rounds import CONTROL_P99_MS, LAYOUTS, ROOT, Load, Run, play, study_text

AGENTS = "human-bc,myopic"


def make_workspace(agents: list[str], folder: Path, load: Load) -> list[str]:
    """A workspace with one study per agent and layout, each a single round; the studies' names."""
    for part in ("layouts", "agents", "questionnaires"):
        shutil.copytree(ROOT / part, folder / part)
    (folder / "studies").mkdir()
    names = []
    for number, (layout, agent) in enumerate(itertools.product(LAYOUTS, agents)):
        names.append(f"bench-{number}")
        text = study_text(load, agent, layout, seed=number)
        (folder / "studies" / f"{names[-1]}.yaml").write_text(text, encoding="utf-8")
    return names


def counts_and_drift(run: Run) -> tuple[list[int], float]:
    """How many ticks each round has on record; how far a deadline lies from its multiple, ms."""
    counts, drift = [], 0.0
    for number in np.unique(run.ticks[:, 0]):
        own = run.ticks[run.ticks[:, 0] == number]
        counts.append(len(own))
        due = own[0, 2] + own[:, 1] * run.load.tick_ms
        drift = max(drift, float(np.abs(own[:, 2] - due).max()))
    return counts, drift


def figures(run: Run) -> list[tuple[str, float, str]]:
    """(name, value, unit) of everything worth knowing about a run."""
    counts, drift = counts_and_drift(run)
    return [
        ("rounds", run.load.rounds, "rounds"),
        ("tick lateness p50", run.lateness(50), "ms"),
        ("tick lateness p99", run.lateness(99), "ms"),
        ("tick lateness max", run.lateness(100), "ms"),
        ("control lateness p50", run.control_lateness(50), "ms"),
        ("control lateness p99", run.control_lateness(99), "ms"),
        ("control lateness max", run.control_lateness(100), "ms"),
        ("fewest ticks of a round", min(counts, default=0), "ticks"),
        ("most ticks of a round", max(counts, default=0), "ticks"),
        ("drift of deadlines", drift, "ms"),
        ("late agents", float(run.ticks[:, 4].mean() * 100) if len(run.ticks) else np.nan, "% of ticks"),
        ("server processor use", run.server_share * 100, "% of a core"),
        ("people processor use", run.people_share * 100, "% of a core"),
        ("server memory, idle", run.idle_mib, "MiB"),
        ("server memory, most", run.most_mib, "MiB"),
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
    parser.add_argument("--agents", default=AGENTS, help="names of agents, which rounds take in turn")
    parser.add_argument("--tries", type=int, default=3, help="runs at most, when the control is late")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    load = Load(options.rounds, options.ticks, options.tick_ms, options.clients)
    command = " ".join(["python benchmarks/rounds.py", *sys.argv[1:]])
    for attempt in range(1, options.tries + 1):
        run = play(load, partial(make_workspace, options.agents.split(",")))
        counts = run.control_lateness(99) <= CONTROL_P99_MS
        table = [
            *figures(run),
            ("run counts", int(counts), "1 yes, 0 repeat it: the control was late"),
        ]
        for name, value, unit in table:
            if options.json:
                print(json.dumps({"name": name, "value": round(value, 3), "unit": unit, "command": command}))
            else:
                print(f"{name:26} {value:10.2f}  {unit}")
        for problem in run.problems:
            print(problem, file=sys.stderr)
        if counts or run.problems:
            break
        print(
            f"run {attempt} of at most {options.tries} does not count: the control was late", file=sys.stderr
        )
    whole = counts_and_drift(run)[0] == [load.ticks] * load.rounds
    return 0 if whole and not run.problems else 1


if __name__ == "__main__":
    sys.exit(main())
