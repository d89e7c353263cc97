"""Optimal plans for two chefs on the move together, asked for by places."""

from __future__ import annotations

from dataclasses import dataclass

from galley.errors import GalleyError
from galley.kitchen.codes import FLOOR, STAY
from galley.kitchen.layout import Layout, Place
from galley.planning.distances import Distances, distances
from galley.planning.joint_motion import joint_tables
from galley.planning.kernels.joint_kernel import FAR, FREE, joint_cost, joint_step, moved

Pose = tuple[int, int, int]
"""(x, y, facing)."""
Goal = Pose | Place | None
"""A pose to be in, a tile (x, y) to face, or nothing: that chef may end anywhere."""


@dataclass(frozen=True)
class JointPlan:
    """`cost` ticks of joint actions (seat 0, seat 1) and the joint poses before, between and after them."""

    cost: int
    actions: tuple[tuple[int, int], ...]
    poses: tuple[tuple[Pose, Pose], ...]


class JointMotion:
    """Exact joint plans on one layout: fewest ticks until both chefs are where they should be, at once.

    A chef moves or stays; interacting moves nobody, so it counts as staying. The movement rules are those
    of `galley.kitchen.rules.shared`: who would meet on a cell or swap cells stays, and turns all the same.
    Costs are kept in tables that fill as they are asked for.

    Raises:
        GalleyError: the layout has more than 256 floor cells.
    """

    def __init__(self, layout: Layout, known: Distances | None = None) -> None:
        self.layout = layout
        self.distances = distances(layout) if known is None else known
        self.tables = joint_tables(layout)

    def cost(self, start: tuple[Pose, Pose], goals: tuple[Goal, Goal]) -> int | None:
        """The ticks of the quickest joint plan, None if there is no plan at all.

        Raises:
            GalleyError: a start or goal is not on the floor, or a tile to face is floor.
        """
        pose0, pose1 = self._start(start)
        found = joint_cost(self.tables, self._goal(goals[0]), self._goal(goals[1]), pose0, pose1)
        return None if found >= FAR else int(found)

    def plan(self, start: tuple[Pose, Pose], goals: tuple[Goal, Goal]) -> JointPlan | None:
        """The quickest joint plan, None if there is none; of equals the one with each chef nearest its goal.

        Raises:
            GalleyError: as `cost`.
        """
        cost = self.cost(start, goals)
        if cost is None:
            return None
        goal0, goal1 = self._goal(goals[0]), self._goal(goals[1])
        pose0, pose1 = self._start(start)
        actions, poses = [], [start]
        for _ in range(cost):
            act0, act1 = divmod(
                joint_step(self.tables, self.distances.costs, goal0, goal1, pose0, pose1, 0), 8
            )
            pose0, pose1 = moved(self.tables, pose0, pose1, act0, act1)
            actions.append((act0, act1))
            poses.append((self._pose(pose0), self._pose(pose1)))
        return JointPlan(cost, tuple(actions), tuple(poses))

    def _start(self, start: tuple[Pose, Pose]) -> tuple[int, int]:
        if start[0][:2] == start[1][:2]:
            raise GalleyError(f"both chefs stand at {start[0][:2]}; give them cells of their own")
        return self._number(start[0]), self._number(start[1])

    def _number(self, pose: Pose) -> int:
        x, y, facing = pose
        inside = 0 <= x < self.layout.width and 0 <= y < self.layout.height
        if not inside or self.layout.tiles[y, x] != FLOOR or not 0 <= facing < STAY:
            raise GalleyError(f"{pose} is no pose on {self.layout.name!r}; use (x, y, facing) on its floor")
        return 4 * int(self.tables.floor_of[self.layout.cell((x, y))]) + facing

    def _pose(self, number: int) -> Pose:
        x, y = self.layout.place(int(self.tables.cell_of[number // 4]))
        return x, y, number % 4

    def _goal(self, goal: Goal) -> int:
        if goal is None:
            return FREE
        if len(goal) == 3:
            return 1 + self.tables.floor_of.size + self._number(goal)
        x, y = goal
        inside = 0 <= x < self.layout.width and 0 <= y < self.layout.height
        if not inside or self.layout.tiles[y, x] == FLOOR:
            raise GalleyError(
                f"{goal} is no tile to face on {self.layout.name!r}; name a station or a counter"
            )
        return 1 + self.layout.cell((x, y))
