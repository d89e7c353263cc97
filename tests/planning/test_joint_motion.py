"""Joint plans are exact: equal to enumeration of joint poses, and they work under the rules."""

from __future__ import annotations

import numpy as np
import pytest

from galley.errors import GalleyError
from galley.kitchen import Kitchen, Layout
from tests.planning.joint_motion import Goal, JointMotion, Pose
from tests.planning.kitchens import FAR, Enumeration, random_kitchen

RING = Layout.from_ascii(
    "ring",
    """
    XXPXX
    X 1 O
    X X X
    D  2X
    XXSXX
    """,
)


def compare(seed: int) -> None:
    layout = random_kitchen(seed)
    every = Enumeration(layout)
    motion = JointMotion(layout)
    random = np.random.default_rng(seed)

    def pose(index: int) -> Pose:
        cell, facing = every.poses[index]
        return (*layout.place(cell), facing)

    def any_goal() -> tuple[Goal, set[int] | None]:
        kind = random.integers(3)
        if kind == 0:
            return None, None
        if kind == 1:
            index = int(random.integers(len(every.poses)))
            return pose(index), {index}
        tiles = [p for p in np.ndindex(layout.width, layout.height) if layout.tiles[p[1], p[0]] != 0]
        x, y = tiles[random.integers(len(tiles))]
        steps = ((0, -1), (0, 1), (1, 0), (-1, 0))
        facing = {
            at
            for at, (cell, facing) in enumerate(every.poses)
            if tuple(np.add(layout.place(cell), steps[facing])) == (x, y)
        }
        return (int(x), int(y)), facing

    for _ in range(4):
        (goal0, set0), (goal1, set1) = any_goal(), any_goal()
        wanted = every.costs(set0, set1)
        for at, (i, j) in enumerate(every.pairs):
            found = motion.cost((pose(i), pose(j)), (goal0, goal1))
            assert (FAR if found is None else found) == wanted[at], (
                layout.grid,
                pose(i),
                pose(j),
                goal0,
                goal1,
            )
        at = int(random.integers(len(every.pairs)))
        start = tuple(pose(index) for index in every.pairs[at])
        plan = motion.plan((start[0], start[1]), (goal0, goal1))
        if plan is not None:
            here = at
            for act0, act1 in plan.actions:
                here = int(every.after[act0 * 5 + act1, here])
            assert wanted[here] == 0
            assert plan.cost == len(plan.actions) == wanted[at]
            assert plan.poses[-1] == tuple(pose(index) for index in every.pairs[here])


@pytest.mark.parametrize("block", range(4))
def test_costs_equal_enumeration_on_small_kitchens(block: int) -> None:
    for seed in range(block * 10, block * 10 + 10):
        compare(seed)


@pytest.mark.full
@pytest.mark.parametrize("block", range(10))
def test_costs_equal_enumeration_on_500_small_kitchens(block: int) -> None:
    for seed in range(1000 + block * 50, 1050 + block * 50):
        compare(seed)


def test_a_plan_in_a_ring_works_under_the_rules() -> None:
    motion = JointMotion(RING)
    (one, other) = RING.starts
    plan = motion.plan(((*one, 0), (*other, 0)), ((0, 3), (4, 1)))
    assert plan is not None
    kitchen = Kitchen(RING)
    for joint in plan.actions:
        kitchen.step(*joint)
    row = kitchen.state.tolist()
    assert (*RING.place(row[0]), row[1]) == plan.poses[-1][0]
    assert (*RING.place(row[3]), row[4]) == plan.poses[-1][1]


def test_a_free_chef_makes_way_in_a_corridor() -> None:
    corridor = Layout.from_ascii(
        "corridor",
        """
        XXXXXX
        P 12 S
        XXXXXX
        """,
    )
    motion = JointMotion(corridor)
    start: tuple[Pose, Pose] = ((2, 1, 0), (3, 1, 0))
    assert motion.cost(start, ((5, 1), None)) is None
    assert motion.cost(start, ((0, 1), None)) == 1
    assert motion.cost(start, (None, (5, 1))) == 1


def test_goals_off_the_kitchen_are_refused() -> None:
    motion = JointMotion(RING)
    start: tuple[Pose, Pose] = ((2, 1, 0), (3, 3, 0))
    with pytest.raises(GalleyError, match="no tile to face"):
        motion.cost(start, ((1, 1), None))
    with pytest.raises(GalleyError, match="no pose"):
        motion.cost(start, ((0, 0, 1), None))
    with pytest.raises(GalleyError, match="cells of their own"):
        motion.cost((start[0], start[0]), (None, None))


def test_a_kitchen_too_large_for_tables_is_refused() -> None:
    rows = ["X" * 20, "X12" + " " * 16 + "X", *["X" + " " * 18 + "X"] * 16, "XPODS" + "X" * 15]
    with pytest.raises(GalleyError, match="floor cells"):
        JointMotion(Layout("hall", tuple(rows)))
