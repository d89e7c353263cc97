"""Random kitchens that two chefs can serve, for benchmarks."""

from __future__ import annotations

import numpy as np

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.planning.distances import distances
from galley.planning.solvable import require_solvable

STATIONS = "POODS"


def random_kitchen(seed: int, width: int = 0, height: int = 0) -> Layout:
    """A kitchen of the given size (0: 7 to 15 by 6 to 10) with 5 or 6 stations, the same for the same seed.

    Counters fill 5 to 40 per cent of the inside, stations stand on tiles beside the floor, both chefs reach
    every station, and two onion orders are to be served.
    """
    for again in range(10_000):
        random = np.random.default_rng((seed, again))
        columns = width or int(random.integers(7, 16))
        rows = height or int(random.integers(6, 11))
        grid = np.full((rows, columns), "X")
        inside = grid[1:-1, 1:-1]
        inside[random.random(inside.shape) > random.uniform(0.05, 0.4)] = " "
        floor = [(int(y), int(x)) for y, x in np.argwhere(grid == " ")]
        beside = sorted(
            {(y + dy, x + dx) for y, x in floor for dy, dx in ((0, 1), (1, 0), (0, -1), (-1, 0))} - set(floor)
        )
        if len(floor) < 12 or len(beside) < 8:
            continue
        letters = STATIONS + ("P" if random.random() < 0.5 else "")
        for letter, at in zip(letters, random.permutation(len(beside)), strict=False):
            grid[beside[at]] = letter
        for chef, at in zip("12", random.permutation(len(floor)), strict=False):
            grid[floor[at]] = chef
        try:
            layout = Layout.from_ascii(
                f"random-{seed}", "\n".join("".join(row) for row in grid),
                cook_time_ticks=10, horizon_ticks=100, orders=("onion", "onion"),
            )  # fmt: skip
            known = distances(layout)
            require_solvable(known)
        except GalleyError:
            continue
        stations = np.isin(layout.tiles.ravel(), (2, 3, 5, 6))
        if known.reachable[:, stations].all():
            return layout
    raise AssertionError(f"seed {seed} makes no kitchen of {width} by {height}")
