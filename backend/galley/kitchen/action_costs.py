"""Fewest actions to face a tile, the other chef left out of account."""

from __future__ import annotations

import numpy as np
from numpy import int16, int32, uint8
from numpy.typing import NDArray

from galley.compiled.kernels import kernel
from galley.kitchen.codes import FLOOR, STAY
from galley.kitchen.layout import Layout

UNREACHABLE = -1
FACINGS_PER_CELL = 4


@kernel
def _costs(tiles: NDArray[uint8], targets: NDArray[int32]) -> NDArray[int16]:
    """int16[H*W*4, K]: see `action_costs`; `tiles` uint8[H,W], `targets` int32[K]."""
    height, width = tiles.shape
    floor = tiles.ravel() == FLOOR
    steps = np.array([-width, width, 1, -1])
    poses = height * width * FACINGS_PER_CELL
    costs = np.full((poses, targets.size), UNREACHABLE, dtype=np.int16)
    queue = np.empty(poses, dtype=np.int32)
    for column in range(targets.size):
        first = 0
        last = 0
        for facing in range(STAY):
            cell = targets[column] - steps[facing]
            if 0 <= cell < floor.size and floor[cell]:
                costs[cell * FACINGS_PER_CELL + facing, column] = 0
                queue[last] = cell * FACINGS_PER_CELL + facing
                last += 1
        while first < last:
            pose = queue[first]
            first += 1
            cell = pose // FACINGS_PER_CELL
            facing = pose % FACINGS_PER_CELL
            # Whoever ends here moved towards `facing`: in from behind, or on the spot against a tile.
            for came_from in (cell - steps[facing], cell):
                if came_from == cell and floor[cell + steps[facing]]:
                    continue
                if not floor[came_from]:
                    continue
                for before in range(STAY):
                    earlier = came_from * FACINGS_PER_CELL + before
                    if costs[earlier, column] == UNREACHABLE:
                        costs[earlier, column] = costs[pose, column] + 1
                        queue[last] = earlier
                        last += 1
    return costs


def action_costs(layout: Layout, targets: NDArray[np.integer]) -> NDArray[np.int16]:
    """int16[H*W*4, K]: fewest actions from each pose to one that faces the target cells (integer [K]).

    Targets are not floor. A pose is `cell * 4 + facing`. 0 means that the chef faces the target already;
    `UNREACHABLE` (-1) that it never can. The other chef is left out of account.
    """
    return _costs(layout.tiles, np.ascontiguousarray(targets, dtype=np.int32))
