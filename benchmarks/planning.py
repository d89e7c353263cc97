"""How fast the planners are on one core, beside those of overcooked-ai 1.1.0 in the same run; their scores.

    python benchmarks/planning.py          one line a figure
    python benchmarks/planning.py --json   one JSON object a figure: name, value, unit, command
    python benchmarks/planning.py --scores the scores of docs/planning.md as well (minutes)

The open kitchen is 15 by 10 with 92 floor cells and 6 stations. Times are processor times of this process, so
that other work on the machine is not counted; kernels are compiled (or fetched from Numba's cache) before.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from galley.agents.protocol import Agent  # noqa: E402
from galley.evaluation.teams import Team, evaluate, play_trials  # noqa: E402
from galley.kitchen import Kitchen, Layout  # noqa: E402
from galley.kitchen.layout_file import load_layout  # noqa: E402
from galley.kitchen.measures import measures  # noqa: E402
from galley.planning.centralized import Centralized  # noqa: E402
from galley.planning.robots import QMDP  # noqa: E402
from tests.planning.joint_motion import JointMotion  # noqa: E402
from tests.planning.package import package_planner  # noqa: E402

COMMAND = "python benchmarks/planning.py"
OPEN = Layout.from_ascii(
    "open kitchen",
    """
    XXXXXXOXXXXXXXX
    X             X
    X 1           X
    X   XXXX      P
    X   XXXX      X
    O             X
    X      XX     P
    X      XX   2 X
    X             X
    XXXXXDXXSXXXXXX
    """,
    cook_time_ticks=10,
    horizon_ticks=100,
    orders=("onion", "onion"),
)
LAYOUTS = (
    "cramped_room", "asymmetric_advantages", "coordination_ring", "forced_coordination", "counter_circuit",
)  # fmt: skip
PAIRS = (
    ("myopic", "myopic", 0), ("mdp", "myopic", 0), ("mdp", "myopic", 1), ("qmdp", "myopic", 0),
    ("qmdp", "myopic", 1), ("centralized", "centralized", 0),
)  # fmt: skip


def ready_s() -> float:
    """Processor seconds until a QMDP robot new to the open kitchen has made its first decision."""
    robot = QMDP()
    state = Kitchen(OPEN).state
    begin = time.process_time()
    robot.reset(OPEN, 0, 0)
    robot.act(state, 0)
    return time.process_time() - begin


def trials_s() -> float:
    """Processor seconds of 50 trials of 100 ticks of QMDP and myopic, from the layout to the medians."""
    endless = Team(epsilon=0.05, orders=())
    begin = time.process_time()
    answer = evaluate(OPEN, endless)
    taken = time.process_time() - begin
    if answer["measures"]["ticks"]["least"] != 100:
        sys.exit("a trial ended before its 100 ticks")
    return taken


def decisions_ms(robot: Agent, ticks: int) -> np.ndarray:
    """Processor milliseconds of each decision (observe and act) of a robot beside a myopic human."""
    layout = OPEN.with_rules(horizon_ticks=ticks, orders=None)
    human = (
        play_trials(layout, Team(orders=(), trials=1, horizon_ticks=ticks))[0].joint_actions[:, 1].tolist()
    )
    robot.reset(layout, 0, 0)
    kitchen = Kitchen(layout)
    times = []
    before, joint = kitchen.state.copy(), None
    for action in human:
        state = kitchen.state.copy()
        begin = time.process_time()
        if joint is not None:
            robot.observe(before, joint)
        own = robot.act(state, kitchen.tick)
        times.append(time.process_time() - begin)
        before, joint = state, (own, action)
        kitchen.step(*joint)
    return np.array(times) * 1000


def joint_plans_s(layout: Layout) -> float:
    """Processor seconds for the costs of all goal pairs from the start: what the package works out ahead."""
    motion = JointMotion(layout)
    begin = time.process_time()
    stations = layout.onions + layout.pots + layout.dishes + layout.servings
    one, other = ((*place, 0) for place in layout.starts)
    for goal in stations:
        for another in stations:
            motion.cost((one, other), (goal, another))
    return time.process_time() - begin


def figures() -> Iterator[tuple[str, float, str, str]]:
    """Each figure as (name, value, unit, bar)."""
    ready_s()
    trials_s()
    yield "ready to act, open 15x10 kitchen", min(ready_s() for _ in range(3)), "s", "<= 0.5"
    yield "50 trials of 100 ticks, QMDP and myopic", min(trials_s() for _ in range(3)), "s", "<= 1.5"
    decisions_ms(Centralized(), 200)
    for name, robot, ticks, bar in (("QMDP", QMDP(), 3000, "< 5"), ("centralized", Centralized(), 1000, "")):
        times = decisions_ms(robot, ticks)
        yield f"{name} decision, p99", float(np.quantile(times, 0.99)), "ms", bar
        yield f"{name} decision, worst", float(times.max()), "ms", ""
    ring = load_layout(ROOT / "layouts" / "counter_circuit.yaml")
    yield "joint motion of all pairs of stations, counter_circuit", joint_plans_s(ring), "s", ""
    yield "overcooked-ai 1.1.0 joint motion, counter_circuit", package_planner(ring)[1], "s", ""


def scores() -> Iterator[tuple[str, float, str, str]]:
    """The mean score over 400 ticks of each pair on each layout of the paper; the robot's seat is named."""
    for name in LAYOUTS:
        layout = load_layout(ROOT / "layouts" / f"{name}.yaml")
        for robot, human, seat in PAIRS:
            trials = 1 if robot == "centralized" else 50
            team = Team(robot, human, 0.0, trials, 400, 0, seat, (), str(ROOT))
            found = [measures(trial).score for trial in play_trials(layout, team)]
            yield f"{name}, {robot} (seat {seat}) and {human}", float(np.mean(found)), "points", ""


def main() -> None:
    """Print every figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--scores", action="store_true")
    options = parser.parse_args()
    sources = (figures, scores) if options.scores else (figures,)
    for source in sources:
        for name, value, unit, bar in source():
            if options.json:
                figure = {
                    "name": name,
                    "value": value,
                    "unit": unit,
                    "command": "python benchmarks/planning.py",
                }
                print(json.dumps(figure), flush=True)
            else:
                print(f"{name:60} {value:10.4g} {unit:7} {bar}", flush=True)


if __name__ == "__main__":
    main()
