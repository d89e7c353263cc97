"""How studies are doing, as researchers see it while they run. Every function reads from a connection."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from sqlalchemy import Connection, func, select

from galley.records.database.tables import NOTES, RESPONSES, ROUNDS, SEATS, STAGES, STUDIES, TICKS, VISITS
from galley.records.reading.flags import Flag, flags
from galley.records.reading.round_replay import nobody
from galley.records.reading.timeline import TimelineEntry, timeline
from galley.records.store.arrivals import slots
from galley.records.store.queries import seconds_between
from galley.study.visit.plan import Plan

__all__ = [
    "AnswerRow",
    "CellCount",
    "Flag",
    "NoteRow",
    "RoundSummary",
    "StageCount",
    "StudyOverview",
    "TimelineEntry",
    "VisitSummary",
    "answers",
    "began",
    "cells",
    "current_rounds",
    "flags",
    "notes",
    "rounds",
    "stages",
    "studies",
    "timeline",
    "visit",
    "visits",
]


@dataclass(frozen=True, slots=True)
class StudyOverview:
    """A study that was visited; `by_status` counts its visits, `tests` left out."""

    name: str
    state: str
    visits_begun: int
    by_status: dict[str, int]
    tests: int
    open_rounds: int


@dataclass(frozen=True, slots=True)
class StageCount:
    """A step with the visits that came to it: `entered` = `left` + `here` + `dropped`."""

    step_id: str
    title: str
    kind: str
    entered: int
    left: int
    here: int
    dropped: int
    median_s: float | None


@dataclass(frozen=True, slots=True)
class CellCount:
    """A cell of the design: slots completed, held by a visit under way, and free to be given out again."""

    cell: dict[str, Any]
    held: int
    completed: int
    free: int


@dataclass(frozen=True, slots=True)
class VisitSummary:
    """A visit in a list; `rounds` were finished, tutorials included, and `notes` counts them."""

    id: int
    study: str
    participant: str
    visit_no: int
    slot: int | None
    condition: dict[str, Any]
    status: str
    step_id: str
    language: str
    test: bool
    created_ms: int
    last_seen_ms: int
    ended_ms: int | None
    link_params: dict[str, str]
    completion_code: str | None
    consent_sha256: str | None
    rounds: int
    notes: int
    flags: tuple[Flag, ...]


@dataclass(frozen=True, slots=True)
class RoundSummary:
    """A round in a list; `ticks_whole` is its whole length over all episodes."""

    id: int
    study: str
    round_no: int
    layout: str
    status: str
    participants: tuple[str, ...]
    agents: tuple[str, ...]
    ticks: int
    ticks_whole: int
    score: int | None
    created_ms: int
    ended_ms: int | None
    visit_ids: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class AnswerRow:
    """One answer with its question as it was shown; `passed` is None unless the item is a check."""

    step_id: str
    item: str
    text: str
    value: Any
    passed: bool | None
    at_ms: int


@dataclass(frozen=True, slots=True)
class NoteRow:
    """A researcher's note about a visit."""

    id: int
    author: str
    text: str
    at_ms: int


def studies(connection: Connection) -> tuple[StudyOverview, ...]:
    """Every study that was visited, by name."""
    by_status: dict[str, dict[str, int]] = defaultdict(dict)
    tests: Counter[str] = Counter()
    columns = (VISITS.c.study, VISITS.c.status, VISITS.c.test)
    for study, status, test, count in connection.execute(select(*columns, func.count()).group_by(*columns)):
        if test:
            tests[study] += count
        else:
            by_status[study][status] = count
    under_way = select(ROUNDS.c.study, func.count()).where(ROUNDS.c.status == "open").group_by(ROUNDS.c.study)
    open_rounds = {study: count for study, count in connection.execute(under_way)}  # noqa: C416 - typed rows
    return tuple(
        StudyOverview(
            row.name,
            row.state,
            row.visits_begun,
            by_status[row.name],
            tests[row.name],
            open_rounds.get(row.name, 0),
        )
        for row in connection.execute(select(STUDIES).order_by(STUDIES.c.name))
    )


def stages(connection: Connection, study: str) -> tuple[StageCount, ...]:
    """Every step that anybody came to, in the order of the plans, tests left out."""
    query = (
        select(STAGES.c.visit_id, STAGES.c.step_id, STAGES.c.entered_ms, STAGES.c.left_ms, VISITS.c.status)
        .join(VISITS, VISITS.c.id == STAGES.c.visit_id)
        .where(VISITS.c.study == study, ~VISITS.c.test)
        .order_by(STAGES.c.visit_id, STAGES.c.entered_ms, STAGES.c.left_ms.is_(None))
    )
    entered: Counter[str] = Counter()
    seconds: dict[str, list[float]] = defaultdict(list)
    last: dict[int, tuple[str, str]] = {}
    for visit_id, step_id, entered_ms, left_ms, status in connection.execute(query):
        entered[step_id] += 1
        last[visit_id] = (step_id, status)
        took_s = seconds_between(entered_ms, left_ms)
        if took_s is not None:
            seconds[step_id].append(took_s)
    at_last = Counter(last.values())
    here = Counter({step: count for (step, status), count in at_last.items() if status == "active"})
    dropped: Counter[str] = Counter()
    for (step, status), count in at_last.items():
        if status not in ("active", "completed"):
            dropped[step] += count
    return tuple(
        StageCount(
            step_id,
            title,
            kind,
            entered[step_id],
            entered[step_id] - here[step_id] - dropped[step_id],
            here[step_id],
            dropped[step_id],
            median(seconds[step_id]) if seconds[step_id] else None,
        )
        for step_id, title, kind in _steps(connection, study, entered)
    )


def _steps(connection: Connection, study: str, wanted: Iterable[str]) -> list[tuple[str, str, str]]:
    """(id, title, kind) of steps, in the order of the newest plan that has them."""
    places: dict[str, tuple[int, str, str]] = {}
    missing = set(wanted)
    while missing:
        plan_with_one = (
            select(VISITS.c.plan_json)
            .join(STAGES, STAGES.c.visit_id == VISITS.c.id)
            .where(VISITS.c.study == study, ~VISITS.c.test, STAGES.c.step_id == min(missing))
            .order_by(VISITS.c.id.desc())
            .limit(1)
        )
        steps = Plan.from_json(connection.execute(plan_with_one).scalar_one()).steps
        for place, step in enumerate(steps):
            places.setdefault(step.id, (place, step.title, step.kind))
        places.setdefault(min(missing), (len(steps), "", ""))
        missing -= places.keys()
    found = sorted((places[step][0], step) for step in wanted)
    return [(step, *places[step][1:]) for _, step in found]


def began(connection: Connection, study: str) -> tuple[tuple[int, str], ...]:
    """When each visit began (ms since 1970) and its status now, in that order, tests left out."""
    query = select(VISITS.c.created_ms, VISITS.c.status).where(VISITS.c.study == study, ~VISITS.c.test)
    return tuple(
        (row.created_ms, row.status) for row in connection.execute(query.order_by(VISITS.c.created_ms))
    )


def cells(connection: Connection, study: str) -> tuple[CellCount, ...]:
    """The cells of the design whose slots were given out, in that order."""
    found: dict[str, list[int]] = {}
    for slot in slots(connection, study):
        counts = found.setdefault(json.dumps(slot.cell, sort_keys=True), [0, 0, 0])
        counts[1 if slot.completed else 2 if slot.ended else 0] += 1
    return tuple(CellCount(json.loads(cell), *counts) for cell, counts in found.items())


def visits(
    connection: Connection,
    study: str,
    *,
    status: str | None = None,
    flagged: bool | None = None,
    tests: bool = False,
    limit: int = 50,
    offset: int = 0,
) -> tuple[VisitSummary, ...]:
    """A study's visits, newest first; `flagged` keeps those with or without a flag, None both."""
    with_flags = flags(connection, study)
    query = select(VISITS).where(VISITS.c.study == study)
    if status is not None:
        query = query.where(VISITS.c.status == status)
    if not tests:
        query = query.where(~VISITS.c.test)
    if flagged is not None:
        is_flagged = VISITS.c.id.in_(list(with_flags))
        query = query.where(is_flagged if flagged else ~is_flagged)
    found = connection.execute(
        query.order_by(VISITS.c.visit_no.desc()).limit(limit).offset(offset)
    ).mappings()
    return _summaries(connection, [dict(row) for row in found], with_flags)


def visit(connection: Connection, visit_id: int) -> VisitSummary | None:
    """One visit, None if there is none."""
    found = connection.execute(select(VISITS).where(VISITS.c.id == visit_id)).mappings().one_or_none()
    if found is None:
        return None
    return _summaries(connection, [dict(found)], flags(connection, found["study"], visit_id))[0]


def _summaries(
    connection: Connection, rows: Sequence[dict[str, Any]], with_flags: Mapping[int, tuple[Flag, ...]]
) -> tuple[VisitSummary, ...]:
    ids = [row["id"] for row in rows]
    finished = (
        select(SEATS.c.visit_id, func.count())
        .join(ROUNDS, ROUNDS.c.id == SEATS.c.round_id)
        .where(SEATS.c.visit_id.in_(ids), ROUNDS.c.status == "finished", ROUNDS.c.round_no > 0)
        .group_by(SEATS.c.visit_id)
    )
    played = {row[0]: row[1] for row in connection.execute(finished)}
    written = (
        select(NOTES.c.visit_id, func.count()).where(NOTES.c.visit_id.in_(ids)).group_by(NOTES.c.visit_id)
    )
    noted = {row[0]: row[1] for row in connection.execute(written)}
    same = set(VisitSummary.__slots__) - {"step_id", "rounds", "notes", "flags"}
    return tuple(
        VisitSummary(
            **{name: row[name] for name in same},
            step_id=Plan.from_json(row["plan_json"]).steps[row["step_index"]].id,
            rounds=played.get(row["id"], 0),
            notes=noted.get(row["id"], 0),
            flags=with_flags.get(row["id"], ()),
        )
        for row in rows
    )


def current_rounds(connection: Connection, study: str) -> tuple[RoundSummary, ...]:
    """The rounds that are open now, newest first."""
    return rounds(connection, study, status="open", limit=1000)


def rounds(
    connection: Connection,
    study: str,
    *,
    visit_id: int | None = None,
    status: str | None = None,
    limit: int = 50,
    offset: int = 0,
) -> tuple[RoundSummary, ...]:
    """A study's rounds, newest first, or those of one of its visits."""
    query = select(ROUNDS).where(ROUNDS.c.study == study)
    if visit_id is not None:
        query = query.where(ROUNDS.c.id.in_(select(SEATS.c.round_id).where(SEATS.c.visit_id == visit_id)))
    if status is not None:
        query = query.where(ROUNDS.c.status == status)
    found = (
        connection.execute(query.order_by(ROUNDS.c.id.desc()).limit(limit).offset(offset)).mappings().all()
    )
    ids = [row["id"] for row in found]
    sitting = (
        select(SEATS.c.round_id, SEATS.c.agent, SEATS.c.hat, SEATS.c.visit_id, VISITS.c.participant)
        .outerjoin(VISITS, VISITS.c.id == SEATS.c.visit_id)
        .where(SEATS.c.round_id.in_(ids))
        .order_by(SEATS.c.round_id, SEATS.c.seat)
    )
    seats: dict[int, list[Any]] = defaultdict(list)
    for seat in connection.execute(sitting):
        seats[seat.round_id].append(seat)
    still = [row["id"] for row in found if row["played_ticks"] is None]
    top = select(TICKS.c.round_id, func.max(TICKS.c.tick) + 1).where(TICKS.c.round_id.in_(still))
    ticks = {row[0]: row[1] for row in connection.execute(top.group_by(TICKS.c.round_id))}
    same = ("id", "study", "round_no", "layout", "status", "score", "created_ms", "ended_ms")
    return tuple(
        RoundSummary(
            **{name: row[name] for name in same},
            participants=tuple(seat.participant for seat in seats[row["id"]] if seat.participant is not None),
            agents=tuple(
                seat.agent for seat in seats[row["id"]] if seat.agent is not None and not nobody(seat)
            ),
            ticks=ticks.get(row["id"], 0) if row["played_ticks"] is None else row["played_ticks"],
            ticks_whole=row["horizon_ticks"] * row["episodes"],
            visit_ids=tuple(seat.visit_id for seat in seats[row["id"]] if seat.visit_id is not None),
        )
        for row in found
    )


def answers(connection: Connection, visit_id: int) -> tuple[AnswerRow, ...]:
    """Everything that a visit answered, in that order."""
    query = select(RESPONSES).where(RESPONSES.c.visit_id == visit_id)
    found = connection.execute(query.order_by(RESPONSES.c.at_ms, RESPONSES.c.step_id, RESPONSES.c.position))
    return tuple(
        AnswerRow(
            row.step_id, row.item, (row.shown or {}).get("text", row.item), row.value, row.passed, row.at_ms
        )
        for row in found
    )


def notes(connection: Connection, visit_id: int) -> tuple[NoteRow, ...]:
    """The notes about a visit, oldest first."""
    query = select(NOTES).where(NOTES.c.visit_id == visit_id).order_by(NOTES.c.id)
    return tuple(NoteRow(row.id, row.author, row.text, row.at_ms) for row in connection.execute(query))
