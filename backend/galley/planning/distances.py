"""Where a chef can get to in a layout, and how soon."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen.action_costs import UNREACHABLE, action_costs
from galley.kitchen.codes import FLOOR
from galley.kitchen.layout import Layout

MOST_CELLS = 1600


@dataclass(frozen=True)
class Distances:
    """Distances of one layout; poses P = H*W*4 as `cell * 4 + facing`, cells H*W as `y * W + x`.

    `costs` int16[P, H*W]: fewest actions from a pose until the chef faces a tile, the other chef left out
    of account; -1 for floor and for tiles it can never face. `reachable` bool[2, H*W]: the tiles that the
    chef of each seat can ever face from its start.
    """

    layout: Layout
    costs: NDArray[np.int16]
    reachable: NDArray[np.bool_]


def distances(layout: Layout) -> Distances:
    """All distances of a layout.

    Raises:
        GalleyError: the layout has more than 1,600 cells, too many for tables.
    """
    tiles = layout.tiles.ravel()
    if tiles.size > MOST_CELLS:
        raise GalleyError(
            f"layout {layout.name!r} has {tiles.size} cells; planners know layouts of at most {MOST_CELLS}"
        )
    targets = np.flatnonzero(tiles != FLOOR)
    costs = np.full((tiles.size * 4, tiles.size), UNREACHABLE, dtype=np.int16)
    costs[:, targets] = action_costs(layout, targets)
    starts = [layout.cell(place) * 4 for place in layout.starts]
    return Distances(layout, costs, costs[starts] != UNREACHABLE)
