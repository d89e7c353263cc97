"""Joint plans of the `overcooked-ai` 1.1.0 package beside ours."""

from __future__ import annotations

import importlib
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from galley.kitchen import Layout
from tests.overcooked_package import mdp
from tests.planning.joint_motion import JointMotion, Pose

FACINGS = {(0, -1): 0, (0, 1): 1, (1, 0): 2, (-1, 0): 3}


@dataclass(frozen=True)
class Pair:
    """A pair of starts and goals: ticks until the first chef is there and until both are, None if never.

    The package's figure for both is of no plan: it does not look for collisions after the first is done.
    """

    start: tuple[Pose, Pose]
    goals: tuple[Pose, Pose]
    theirs_first: float
    theirs_both: float
    ours_first: int | None
    ours_both: int | None


def package_planner(layout: Layout) -> tuple[Any, float]:
    """The package's joint motion planner of a layout, without counters as goals, and the seconds it took."""
    package = mdp()
    if not hasattr(np, "Inf"):
        np.Inf = np.inf  # type: ignore[attr-defined]  # the package was written for NumPy 1
    planners = importlib.import_module("overcooked_ai_py.planning.planners")
    # Where a plan's rest would lead is not compared, and asking for it wants gym.
    planners.JointMotionPlanner._rollout_end_pos_and_or = lambda *_: ()
    orders = [{"ingredients": ["onion"] * 3}]
    world = package.OvercookedGridworld.from_grid(list(layout.grid), {"start_all_orders": orders})
    begin = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        planner = planners.JointMotionPlanner(world, planners.NO_COUNTERS_PARAMS)
    return planner, time.perf_counter() - begin


def compare(layout: Layout, planner: Any) -> Iterator[Pair]:
    """Every pair of starts and goals that the package has a plan for."""
    motion = JointMotion(layout)

    def pose(told: Any) -> Pose:
        (x, y), facing = told
        return int(x), int(y), FACINGS[facing]

    for (start, goal), (_, _, lengths) in planner.all_plans.items():
        here = (pose(start[0]), pose(start[1]))
        there = (pose(goal[0]), pose(goal[1]))
        alone = [motion.cost(here, (there[0], None)), motion.cost(here, (None, there[1]))]
        both = None if there[0][:2] == there[1][:2] else motion.cost(here, there)
        yield Pair(
            here, there, float(min(lengths)) - 1, float(max(lengths)) - 1,
            min((one for one in alone if one is not None), default=None), both,
        )  # fmt: skip
