"""Subtasks of a seat in a state, by name and place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.kitchen.layout import Place
from galley.planning.distances import Distances
from galley.planning.kernels.myopic_kernel import target
from galley.planning.kernels.subtask_kernel import KINDS, WAIT, kind_of
from galley.planning.kernels.subtask_kernel import subtasks as _fill
from galley.planning.subtasks import SUBTASKS


def feasible_subtasks(known: Distances, state: NDArray[np.int16], seat: int) -> dict[str, tuple[Place, ...]]:
    """For each feasible subtask of a seat in a state (int16[S]), up to three tiles for it, nearest first.

    Waiting is left out unless nothing else can be done; it has no tile.
    """
    out = np.zeros((KINDS, 4), dtype=np.int16)
    _fill(known.layout.spec, known.costs, known.reachable, state, seat, out)
    found = {
        SUBTASKS[kind].name: tuple(known.layout.place(int(cell)) for cell in row[1 : 1 + row[0]])
        for kind, row in enumerate(out)
        if row[0] > 0
    }
    return found or {SUBTASKS[WAIT].name: ()}


def myopic_subtask(known: Distances, state: NDArray[np.int16], seat: int) -> tuple[str, Place | None]:
    """The subtask that the myopic human on a seat is at, and its tile."""
    cell = int(target(known.layout.spec, known.costs, known.reachable, state, seat))
    kind = int(kind_of(known.layout.spec, state, seat, cell))
    return SUBTASKS[kind].name, None if cell < 0 else known.layout.place(cell)
