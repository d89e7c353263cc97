"""The subtasks of the kitchen by name: when each is feasible, and for a state which are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from galley.kitchen.layout import Place
from galley.planning.distances import Distances
from galley.planning.kernels.myopic_kernel import target
from galley.planning.kernels.subtask_kernel import KINDS, WAIT, kind_of
from galley.planning.kernels.subtask_kernel import subtasks as _fill


@dataclass(frozen=True)
class Subtask:
    """One kind of subtask: what the chef holds who takes it up, and when it is feasible."""

    name: str
    holding: str
    feasible: str


SUBTASKS = (
    Subtask("wait", "anything", "nothing else is"),
    Subtask("take onion", "nothing", "some pot can take an onion, or the other chef needs one passed"),
    Subtask("take tomato", "nothing", "some pot can take a tomato, or the other chef needs one passed"),
    Subtask(
        "take dish", "nothing", "a soup cooks or is ready and no dish is on its way, or one must be passed"
    ),
    Subtask("take soup", "nothing", "a finished soup that the next order asks for lies on a counter"),
    Subtask("fill pot", "onion or tomato", "some pot can take it"),
    Subtask("fetch soup", "dish", "a soup cooks or is ready in a pot; who is early waits beside it"),
    Subtask("deliver", "soup", "always, unless it is ordered only later"),
    Subtask("drop", "anything", "the thing is of no use in hand: on a shared counter if the other needs it"),
)
"""In the order of the kernels' codes. Source: Fontaine et al. 2021 (RSS), Fig. 9; passing, orders: ours."""


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
