"""Small random kitchens, and joint motion by enumeration of joint poses under the rules themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import STAY, KitchenBatch, Layout, Rules
from galley.kitchen.codes import CELL, CHEF, DELIVERIES, FACING, TICK
from galley.kitchen.trajectory import start
from galley.planning.distances import distances
from galley.planning.solvable import require_solvable

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
    """All joint poses of a kitchen and where each of the 25 joint moves takes them, by the rules."""

    def __init__(self, layout: Layout) -> None:
        cells = [layout.cell(place) for place in layout.floor]
        self.poses = [(cell, facing) for cell in cells for facing in range(4)]
        pairs = [
            (i, j) for i, (c, _) in enumerate(self.poses) for j, (d, _) in enumerate(self.poses) if c != d
        ]
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


def furnished_kitchen(seed: int) -> Layout:
    """A solvable kitchen of at most 6 floor cells with one order, few counters and stations all around."""
    for again in range(1000):
        random = np.random.default_rng((seed, again))
        stations = "".join(random.permutation(list("PODSPOOD")))
        bare = random_kitchen(int(random.integers(1 << 30)), most_floor=6, stations="")
        beside = {
            (x + dx, y + dy) for x, y in bare.floor for dx, dy in ((0, -1), (0, 1), (1, 0), (-1, 0))
        } - set(bare.floor)
        grid = [list(row) for row in bare.grid]
        places = sorted(beside)
        chosen = [places[at] for at in random.permutation(len(places))]
        letters = stations + "DSOP" * 10
        for (x, y), letter in zip(chosen[: max(0, len(chosen) - 2)], letters, strict=False):
            grid[y][x] = letter
        try:
            rules = Rules(cook_time_ticks=3, horizon_ticks=80, orders=("onion",))
            layout = Layout(f"furnished-{seed}", tuple("".join(row) for row in grid), rules)
            require_solvable(distances(layout))
        except GalleyError:
            continue
        return layout
    raise AssertionError(f"no solvable kitchen for seed {seed}")


def fewest_ticks(layout: Layout, most_states: int = 3_000_000) -> int | None:
    """The fewest ticks until the order list is served, by search of every state; None if it never is."""
    joint = np.array(list(np.ndindex(6, 6)), dtype=np.uint8)
    frontier = start(layout)[None]
    seen = np.empty(0, dtype=np.uint64)
    orders = len(layout.rules.orders or ())
    for tick in range(layout.rules.horizon_ticks):
        if (frontier[:, DELIVERIES] >= orders).any():
            return tick
        batch = KitchenBatch(layout, len(frontier) * 36)
        batch.states[:] = np.repeat(frontier, 36, axis=0)
        batch.step(np.tile(joint, (len(frontier), 1)))
        keys = _keys(batch.states)
        _, first = np.unique(keys, return_index=True)
        new = first[~np.isin(keys[first], seen, assume_unique=True)]
        frontier = batch.states[new].copy()
        seen = np.concatenate([seen, keys[new]])
        if len(seen) > most_states:
            return None
    return None


def _keys(states: NDArray[np.int16]) -> NDArray[np.uint64]:
    """uint64[B]: a hash of each state without its tick."""
    keys = np.zeros(len(states), dtype=np.uint64)
    for column in range(states.shape[1]):
        if column != TICK:
            keys = (keys ^ (states[:, column] + 7).astype(np.uint64)) * np.uint64(0x100000001B3)
            keys ^= keys >> np.uint64(29)
    return keys
