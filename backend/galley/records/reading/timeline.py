"""Everything that happened in a visit, in order of time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Select, Table, select

from galley.records.database.tables import (
    ABSENCES,
    ATTEMPTS,
    NOTES,
    PAUSES,
    ROUNDS,
    SEATS,
    STAGES,
    STAND_INS,
    VISITS,
)
from galley.records.store.queries import seconds_between

# What comes first of what happened in the same millisecond.
ORDER = (
    "began",
    "left",
    "entered",
    "round",
    "stand_in",
    "paused",
    "attempt",
    "hidden",
    "round_over",
    "note",
    "ended",
)


@dataclass(frozen=True, slots=True)
class TimelineEntry:
    """One thing that happened; the step and the round it belongs to, if any."""

    at_ms: int
    kind: str
    words: str
    step_id: str | None = None
    round_id: int | None = None


def timeline(connection: Connection, visit_id: int) -> tuple[TimelineEntry, ...]:
    """What happened in a visit, first things first."""
    found = [
        *_visit(connection, visit_id),
        *_stages(connection, visit_id),
        *_rounds(connection, visit_id),
        *_others(connection, visit_id),
    ]
    return tuple(sorted(found, key=lambda entry: (entry.at_ms, ORDER.index(entry.kind))))


def _visit(connection: Connection, visit_id: int) -> Iterator[TimelineEntry]:
    for row in connection.execute(select(VISITS).where(VISITS.c.id == visit_id)):
        yield TimelineEntry(row.created_ms, "began", "the visit began")
        if row.ended_ms is not None:
            yield TimelineEntry(row.ended_ms, "ended", f"the visit ended: {row.status.replace('_', ' ')}")


def _stages(connection: Connection, visit_id: int) -> Iterator[TimelineEntry]:
    for row in connection.execute(select(STAGES).where(STAGES.c.visit_id == visit_id)):
        times = f", sent {row.views} times" if row.views > 1 else ""
        yield TimelineEntry(row.entered_ms, "entered", f"came to {row.step_id}{times}", row.step_id)
        if row.left_ms is not None:
            yield TimelineEntry(row.left_ms, "left", f"went on from {row.step_id}", row.step_id)


def _rounds(connection: Connection, visit_id: int) -> Iterator[TimelineEntry]:
    query = select(ROUNDS, SEATS.c.step_id).join(SEATS, SEATS.c.round_id == ROUNDS.c.id)
    for row in connection.execute(query.where(SEATS.c.visit_id == visit_id)).all():
        at = (row.step_id, row.id)
        yield TimelineEntry(row.created_ms, "round", f"round {row.round_no} on {row.layout} set up", *at)
        if row.ended_ms is not None:
            score = "" if row.score is None else f", score {row.score}"
            yield TimelineEntry(row.ended_ms, "round_over", f"round {row.round_no} {row.status}{score}", *at)
        for pause in connection.execute(select(PAUSES).where(PAUSES.c.round_id == row.id)):
            lasted = _lasted(pause.started_ms, pause.ended_ms)
            words = f"paused at tick {pause.tick}{lasted}: {pause.reason}"
            yield TimelineEntry(round(pause.started_ms), "paused", words, *at)
        for other in connection.execute(select(STAND_INS).where(STAND_INS.c.round_id == row.id)):
            words = f"{other.agent} took seat {other.seat} at tick {other.tick}"
            yield TimelineEntry(other.at_ms, "stand_in", words, *at)


def _others(connection: Connection, visit_id: int) -> Iterator[TimelineEntry]:
    for row in connection.execute(_of(ATTEMPTS, visit_id)):
        words = f"attempt {row.attempt} failed: {', '.join(row.wrong)}"
        yield TimelineEntry(row.at_ms, "attempt", words, row.step_id)
    for row in connection.execute(_of(ABSENCES, visit_id)):
        lasted = _lasted(row.started_ms, row.ended_ms)
        yield TimelineEntry(row.started_ms, "hidden", f"page hidden{lasted}", row.step_id)
    for row in connection.execute(_of(NOTES, visit_id)):
        yield TimelineEntry(row.at_ms, "note", f"{row.author}: {row.text}")


def _lasted(started_ms: float, ended_ms: float | None) -> str:
    seconds = seconds_between(started_ms, ended_ms)
    return "" if seconds is None else f" for {seconds:.1f} s"


def _of(table: Table, visit_id: int) -> Select[Any]:
    return select(table).where(table.c.visit_id == visit_id)
