"""Joint motion is never worse than the planner of the overcooked-ai package, over all its pairs of goals."""

from __future__ import annotations

from pathlib import Path

import pytest

from galley.kitchen.layout_file import load_layout
from tests.planning.package import compare, package_planner

LAYOUTS = Path(__file__).resolve().parents[2] / "layouts"


def check(name: str) -> None:
    layout = load_layout(LAYOUTS / f"{name}.yaml")
    planner, _ = package_planner(layout)
    pairs = list(compare(layout, planner))
    assert pairs
    for pair in pairs:
        assert pair.ours_first is not None, pair
        assert pair.ours_first <= pair.theirs_first, pair
        # Its figure for both is of no plan: it stops looking for collisions when the first is done. Where it
        # is below ours (which equals enumeration) the chef that is done stands in the other's way.
        if pair.ours_both is not None and pair.theirs_both < pair.ours_both:
            assert pair.theirs_first < pair.theirs_both, pair


def test_joint_motion_is_never_worse_than_the_package_on_cramped_room() -> None:
    check("cramped_room")


@pytest.mark.full
@pytest.mark.parametrize(
    "name", ["asymmetric_advantages", "coordination_ring", "forced_coordination", "counter_circuit"]
)
def test_joint_motion_is_never_worse_than_the_package(name: str) -> None:
    check(name)
