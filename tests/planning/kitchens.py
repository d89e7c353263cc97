"""Small random kitchens, and joint motion by enumeration of joint poses under the rules themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.kitchen import STAY, KitchenBatch, Layout
from galley.kitchen.codes import CELL, CHEF, FACING

FAR = 32000


def random_kitchen(seed: int, most_floor: int = 8, stations: str = "POODS") -> Layout:
    """A closed kitchen of at most `most_floor` floor cells, both chefs somewhere on it."""
    random = np.random.default_rng(seed)
    while True:
        height, width = random.integers(3, 6), random.integers(4, 7)
        grid = np.full((height, width), "X")
        inner = grid[1:-1, 1:-1]
        inner[random.random(inner.shape) < random.uniform(0.6, 1)] = " "
        floor = np.argwhere(grid == " ")
        if not 2 <= len(floor) <= most_floor:
            continue
        for number, (y, x) in enumerate(random.permutation(floor)[:2], start=1):
            grid[y, x] = str(number)
        counters = random.permutation(np.argwhere(grid == "X"))
        for (y, x), letter in zip(counters, stations, strict=False):
            grid[y, x] = letter
        return Layout(f"random-{seed}", tuple("".join(row) for row in grid))


class Enumeration:
    """All joint poses of a kitchen and where each of the 25 joint moves takes them, by the rules' own kernel."""

    def __init__(self, layout: Layout) -> None:
        cells = [layout.cell(place) for place in layout.floor]
        self.poses = [(cell, facing) for cell in cells for facing in range(4)]
        pairs = [(i, j) for i, (c, _) in enumerate(self.poses) for j, (d, _) in enumerate(self.poses) if c != d]
        self.pairs = pairs
        number = {pair: at for at, pair in enumerate(pairs)}
        pose = {pose: at for at, pose in enumerate(self.poses)}
        self.after = np.empty((25, len(pairs)), dtype=np.int64)
        for move in range(25):
            batch = KitchenBatch(layout, len(pairs))
            for at, (i, j) in enumerate(pairs):
                batch.states[at, CELL], batch.states[at, FACING] = self.poses[i]
                batch.states[at, CHEF + CELL], batch.states[at, CHEF + FACING] = self.poses[j]
            batch.step(np.full((len(pairs), 2), divmod(move, STAY + 1), dtype=np.uint8))
            for at, row in enumerate(batch.states.tolist()):
                one = pose[row[CELL], row[FACING]]
                other = pose[row[CHEF + CELL], row[CHEF + FACING]]
                self.after[move, at] = number[one, other]

    def costs(self, goal0: set[int] | None, goal1: set[int] | None) -> NDArray[np.int64]:
        """The fewest ticks from each pair of poses until both are in their sets of poses (None: any)."""
        cost = np.full(len(self.pairs), FAR)
        for at, (i, j) in enumerate(self.pairs):
            if (goal0 is None or i in goal0) and (goal1 is None or j in goal1):
                cost[at] = 0
        while True:
            nearer = np.minimum(cost, np.minimum(cost[self.after].min(axis=0) + 1, FAR))
            if np.array_equal(nearer, cost):
                return cost
            cost = nearer
