"""Who gets which condition: numbered slots, each with a cell of the design, so that cells stay even.

Slot 0, 1, 2, ... belong to the cells in permuted blocks, so the first n slots hold every cell equally often
up to one. A slot is held by one visit until that visit completes it. When a visit is over otherwise, or shows
no sign of life for too long, its slot keeps counting until the next arrival gets it. So the slots that are
held or completed are always the first n, and their cells never differ by more than one; and when as many
slots as the quota allows are completed, every cell has exactly its quota.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Final

import numpy as np

from galley.study.visit.counterbalance import in_blocks

if TYPE_CHECKING:
    from galley.study.study import Study
    from galley.study.written.study_file import StudyFile

CELLS: Final = 1
DRAWN: Final = 2
"""First numbers of the tags of what is balanced over slots; the design of stages uses 3."""

UNANSWERED_MS: Final = 15 * 60_000.0
"""After which the slot of a visit that never went beyond its first step is free at the latest."""


@dataclass(frozen=True, slots=True)
class Slot:
    """A slot that was given out: `ended` says that its visit is over without having completed it, `answered`
    that its visit has left its first step.
    """

    number: int
    completed: bool
    ended: bool
    last_seen_ms: float
    answered: bool = field(default=True, kw_only=True)


@dataclass(frozen=True, slots=True)
class Issue:
    """The arrival gets this slot; `again` says that it was another visit's, which is then expired."""

    number: int
    again: bool


@dataclass(frozen=True, slots=True)
class Full:
    """No slot is left; `closed` says that all are completed, so that none will come free either."""

    closed: bool


def allocate(slots: Iterable[Slot], now_ms: float, expires_ms: float, capacity: int | None) -> Issue | Full:
    """The slot for an arrival at `now_ms`: the lowest one that came free, else the next, else none.

    `slots` are all that were ever given out, each once, by its last holder. `expires_ms` without a sign of
    life set a slot free, or UNANSWERED_MS if its visit never answered. `capacity` is the number of
    slots in all, or None for no end.
    """
    given = 0
    completed = 0
    free: int | None = None
    for slot in slots:
        given = max(given, slot.number + 1)
        completed += slot.completed
        kept_ms = expires_ms if slot.answered else min(expires_ms, UNANSWERED_MS)
        gone = slot.ended or now_ms - slot.last_seen_ms >= kept_ms
        if not slot.completed and gone and (free is None or slot.number < free):
            free = slot.number
    if free is not None:
        return Issue(free, again=True)
    if capacity is None or given < capacity:
        return Issue(given, again=False)
    return Full(closed=completed >= capacity)


def cells(config: StudyFile) -> tuple[dict[str, str], ...]:
    """The cells of the design: every combination of the full factors' levels; one empty cell without any."""
    full = {name: factor for name, factor in config.factors.items() if factor.assign == "full"}
    chosen = product(*(factor.levels for factor in full.values()))
    return tuple(dict(zip(full, levels, strict=True)) for levels in chosen)


def cell_number(study: Study, slot: int) -> int:
    """The place in `cells` of the cell that a slot belongs to."""
    return in_blocks(study.config.seed, (CELLS,), slot, len(cells(study.config)))


def place_in_cell(study: Study, slot: int) -> int:
    """How many slots before this one belong to its cell."""
    return slot // len(cells(study.config))


def slot_in_cell(study: Study, cell: int, place: int) -> int:
    """The slot of a cell that has `place` slots of it before; of the last cell if there are not so many."""
    count = len(cells(study.config))
    block = range(place * count, (place + 1) * count)
    return next(slot for slot in block if cell_number(study, slot) == min(cell, count - 1))


def cell_of_slot(study: Study, slot: int) -> dict[str, str]:
    """The condition of a slot: the level of every factor, in the order of the file."""
    config = study.config
    cell = cells(config)[cell_number(study, slot)]
    shift = sum(config.factors[name].levels.index(level) for name, level in cell.items())
    condition = {}
    for number, (name, factor) in enumerate(config.factors.items()):
        count = len(factor.levels)
        match factor.assign:
            case "full":
                level = cell[name]
            case "latin_square":
                level = factor.levels[shift % count]
            case "fixed":
                level = factor.levels[slot % count]
            case "random":
                sequence = np.random.SeedSequence(config.seed, spawn_key=(2, DRAWN, number, slot))
                level = factor.levels[int(np.random.default_rng(sequence).integers(count))]
        condition[name] = level
    return condition


def capacity(study: Study) -> int | None:
    """How many slots a study has: its quota for each cell; None without a quota."""
    quota = study.config.quota
    return None if quota is None else quota * len(cells(study.config))
