"""Empty tables of joint motion for a layout, which kernels fill."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen.codes import FLOOR
from galley.kitchen.layout import Layout
from galley.planning.kernels.joint_kernel import MOST_POSES, NONE, STEPS_KNOWN, JointTables

MOST_FLOOR_CELLS = 256
"""A table of joint costs has (F + 4)^2 entries; beyond this many floor cells it takes too long to fill."""
TABLES_BYTES = 48 * 2**20
"""Memory for the tables of one layout; the oldest gives way when it is used up."""


def joint_tables(layout: Layout) -> JointTables:
    """Empty tables for a layout.

    Raises:
        GalleyError: the layout has more than 256 floor cells.
    """
    tiles = layout.tiles.ravel()
    cell_of = np.flatnonzero(tiles == FLOOR).astype(np.int16)
    floors = int(cell_of.size)
    if floors > MOST_FLOOR_CELLS:
        raise GalleyError(
            f"layout {layout.name!r} has {floors} floor cells; "
            f"joint plans are known for at most {MOST_FLOOR_CELLS}"
        )
    floor_of: NDArray[np.int16] = np.full(tiles.size, NONE, dtype=np.int16)
    floor_of[cell_of] = np.arange(floors)
    steps = np.array([-layout.width, layout.width, 1, -1], dtype=np.int16)
    faced = (cell_of[:, None] + steps).astype(np.int16)
    goals = 1 + tiles.size + 4 * floors
    size = floors + MOST_POSES
    slots = min(max(TABLES_BYTES // (2 * size * size), 64), goals * goals)
    return JointTables(
        floor_of=floor_of,
        cell_of=cell_of,
        ahead=floor_of[faced],
        ends=_ends(faced, tiles.size),
        slot=np.full((goals, goals), NONE, dtype=np.int32),
        pair=np.zeros((slots, 2), dtype=np.int32),
        used=np.zeros(1, dtype=np.int32),
        tables=np.empty((slots, size, size), dtype=np.int16),
        queue=np.empty(size * size, dtype=np.int32),
        steps=np.zeros(STEPS_KNOWN, dtype=np.int64),
    )


def _ends(faced: NDArray[np.int16], cells: int) -> NDArray[np.int16]:
    """int16[G, 4]: the poses that end each goal; `faced` int16[F, 4] is the cell that each pose faces."""
    ends: NDArray[np.int16] = np.full((1 + cells + faced.size, MOST_POSES), NONE, dtype=np.int16)
    for pose, cell in enumerate(faced.ravel().tolist()):
        row = ends[1 + cell]
        row[np.argmin(row >= 0)] = pose
        ends[1 + cells + pose, 0] = pose
    return ends
