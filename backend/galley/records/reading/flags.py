"""Visits whose data a researcher should look at before using it, found by counting."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from sqlalchemy import ColumnElement, Connection, Select, func, select, true

from galley.records.database.tables import ABSENCES, RESPONSES, ROUNDS, SEATS, STAGES, VISITS
from galley.study.visit.plan import Plan
from galley.study.written.recruitment import is_placeholder

# From here on a partner that stands still now and then may be felt.
LATE_SHARE: Final = 0.01
HIDDEN_S: Final = 60.0
# Two ticks of 150 ms: what the person sees is that much behind what the kitchen does.
SLOW_RTT_MS: Final = 300.0

SIMULATED: Final = "simulated-"
"""Begins the name of a participant who was not there, in an export of a simulation."""

FLAGS: Final = {
    "late_agent": "the agent was late or at fault in more than 1% of the ticks played",
    "hidden_tab": "the page was hidden for more than a minute in all",
    "failed_checks": "an attention check was not answered as expected",
    "no_id": "the link held a placeholder where the recruiter should have put a person's id",
    "interrupted": "the visit ended early because a file that it needs was changed or removed",
    "simulated": "nobody was there: galley simulate made the visit",
    "clock_set_back": "the clock was set back while the visit ran: some of its durations are missing",
    "slow_client": "in some round, half of all round trips took more than 300 ms",
}
"""Every kind of flag and what it means."""


@dataclass(frozen=True, slots=True)
class Flag:
    """Something about a visit that stands out: a kind of FLAGS, its number, and both in words."""

    kind: str
    value: float
    words: str


def flags(
    connection: Connection, study: str, visit_id: int | None = None, *, tests: bool = True
) -> dict[int, tuple[Flag, ...]]:
    """The flags of every visit of a study that has any, or of one visit; `tests` says whether of tests."""
    these = (VISITS.c.study == study) if visit_id is None else (VISITS.c.id == visit_id)
    if not tests:
        these = these & ~VISITS.c.test
    found: dict[int, list[Flag]] = defaultdict(list)
    for rule in (_late, _hidden, _failed, _unnamed, _interrupted, _simulated, _set_back, _slow):
        for visit, flag in rule(connection, these):
            found[visit].append(flag)
    return {visit: tuple(of_visit) for visit, of_visit in sorted(found.items())}


Found = Iterator[tuple[int, Flag]]


def _of(these: ColumnElement[bool], table: Any, *columns: Any) -> Select[Any]:
    return select(VISITS.c.id, *columns).join(table, table.c.visit_id == VISITS.c.id).where(these)


def _late(connection: Connection, these: ColumnElement[bool]) -> Found:
    bad, played = func.sum(ROUNDS.c.late_ticks + ROUNDS.c.fault_ticks), func.sum(ROUNDS.c.played_ticks)
    query = _of(these, SEATS, bad, played).join(ROUNDS, ROUNDS.c.id == SEATS.c.round_id)
    for visit, late, ticks in connection.execute(query.group_by(VISITS.c.id)):
        if late and late / ticks > LATE_SHARE:
            yield visit, Flag("late_agent", float(late / ticks), f"{late} of {ticks} ticks of the agent late")


def _hidden(connection: Connection, these: ColumnElement[bool]) -> Found:
    query = _of(these, ABSENCES, func.sum(ABSENCES.c.ended_ms - ABSENCES.c.started_ms), func.count())
    query = query.where(func.coalesce(ABSENCES.c.ended_ms >= ABSENCES.c.started_ms, true()))
    for visit, hidden_ms, times in connection.execute(query.group_by(VISITS.c.id)):
        seconds = float(hidden_ms or 0) / 1000
        if seconds > HIDDEN_S:
            yield visit, Flag("hidden_tab", seconds, f"hidden for {seconds:.0f} s, {times} times")


def _failed(connection: Connection, these: ColumnElement[bool]) -> Found:
    query = _of(these, RESPONSES, VISITS.c.plan_json, RESPONSES.c.step_id)
    counts: dict[int, int] = defaultdict(int)
    for visit, plan, step_id in connection.execute(query.where(RESPONSES.c.passed.is_(False))):
        # As the study counts them: the answers of a quiz that went on after its last try are no checks.
        if (step_id, "quiz") not in {(step.id, step.kind) for step in Plan.from_json(plan).steps}:
            counts[visit] += 1
    for visit, count in counts.items():
        yield (
            visit,
            Flag("failed_checks", float(count), f"{count} checks failed" if count > 1 else "1 check failed"),
        )


def _unnamed(connection: Connection, these: ColumnElement[bool]) -> Found:
    query = select(VISITS.c.id, VISITS.c.link_params).where(these, VISITS.c.person.is_(None))
    for visit, params in connection.execute(query):
        for name, value in params.items():
            if is_placeholder(value, name):
                yield visit, Flag("no_id", 1.0, f"{name} was a placeholder")
                break


def _interrupted(connection: Connection, these: ColumnElement[bool]) -> Found:
    query = select(VISITS.c.id).where(these, VISITS.c.status == "interrupted")
    for visit in connection.execute(query).scalars():
        yield visit, Flag("interrupted", 1.0, "a file that it needs was changed or removed")


def _simulated(connection: Connection, these: ColumnElement[bool]) -> Found:
    query = select(VISITS.c.id).where(these, VISITS.c.participant.startswith(SIMULATED))
    for visit in connection.execute(query).scalars():
        yield visit, Flag("simulated", 1.0, "made by galley simulate")


def _set_back(connection: Connection, these: ColumnElement[bool]) -> Found:
    spans = (
        select(VISITS.c.id).where(these, VISITS.c.ended_ms < VISITS.c.created_ms),
        _of(these, STAGES).where(STAGES.c.left_ms < STAGES.c.entered_ms),
        _of(these, ABSENCES).where(ABSENCES.c.ended_ms < ABSENCES.c.started_ms),
    )
    counts = Counter(visit for query in spans for visit in connection.execute(query).scalars())
    for visit, count in counts.items():
        yield visit, Flag("clock_set_back", float(count), f"{count} durations are missing")


def _slow(connection: Connection, these: ColumnElement[bool]) -> Found:
    query = _of(these, SEATS, func.max(SEATS.c.rtt_median_ms)).group_by(VISITS.c.id)
    for visit, rtt_ms in connection.execute(query):
        if rtt_ms is not None and rtt_ms > SLOW_RTT_MS:
            yield visit, Flag("slow_client", float(rtt_ms), f"round trips of {rtt_ms:.0f} ms")
