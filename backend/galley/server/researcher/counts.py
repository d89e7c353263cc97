"""Numbers of the records put together for the researcher's pages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from galley.study.study import Study
from galley.study.visit.condition_slots import cells

MINUTE_MS = 60_000
HOUR_MS = 60 * MINUTE_MS
DAY_MS = 24 * HOUR_MS
SPANS = {
    10 * MINUTE_MS: "10 minutes",
    HOUR_MS: "an hour",
    6 * HOUR_MS: "6 hours",
    DAY_MS: "a day",
    7 * DAY_MS: "7 days",
    28 * DAY_MS: "28 days",
    364 * DAY_MS: "364 days",
}
MOST_SPANS = 48
UNDER_WAY = "active"
DONE = "completed"


def study_rows(found: Iterable[Any], served: Mapping[str, Study]) -> list[dict[str, Any]]:
    """One row per study that is served or was visited (StudyOverview), by name."""
    rows: dict[str, dict[str, Any]] = {}
    for name, study in served.items():
        rows[name] = _row(name, study.title, "open", {}, 0, 0, served=True)
    for row in found:
        title = served[row.name].title if row.name in served else row.name
        rows[row.name] = _row(
            row.name, title, row.state, row.by_status, row.tests, row.open_rounds, served=row.name in served
        )
    return [rows[name] for name in sorted(rows)]


def _row(
    name: str,
    title: str,
    state: str,
    by_status: Mapping[str, int],
    tests: int,
    open_rounds: int,
    *,
    served: bool,
) -> dict[str, Any]:
    begun = sum(by_status.values())
    return {
        "name": name,
        "title": title,
        "state": state,
        "served": served,
        "begun": begun,
        "active": by_status.get(UNDER_WAY, 0),
        "completed": by_status.get(DONE, 0),
        "left": begun - by_status.get(UNDER_WAY, 0) - by_status.get(DONE, 0),
        "by_status": dict(by_status),
        "tests": tests,
        "open_rounds": open_rounds,
    }


def cell_rows(found: Iterable[Any], study: Study | None) -> list[dict[str, Any]]:
    """One row per cell of the design with its slots (CellCount), those nobody came to included.

    `quota` is the number of completions that close the cell, None without one.
    """
    quota = None if study is None else study.config.quota
    rows = [
        {"cell": row.cell, "completed": row.completed, "held": row.held, "waiting": row.free, "quota": quota}
        for row in found
    ]
    for cell in () if study is None else cells(study.config):
        if not any(row["cell"] == cell for row in rows):
            rows.append({"cell": dict(cell), "completed": 0, "held": 0, "waiting": 0, "quota": quota})
    return rows


def flag_counts(flags: Mapping[int, Iterable[Any]]) -> list[dict[str, Any]]:
    """One row per kind of flag with how many visits have it, most first; `flags` are Flags by visit."""
    kinds: dict[str, int] = {}
    for of_visit in flags.values():
        for kind in {flag.kind for flag in of_visit}:
            kinds[kind] = kinds.get(kind, 0) + 1
    return [
        {"kind": kind, "visits": count} for kind, count in sorted(kinds.items(), key=lambda pair: -pair[1])
    ]


def arrivals(began: Sequence[tuple[int, str]]) -> dict[str, Any]:
    """How many visits began in each stretch of time from the first to the last, and what became of them.

    `began` are times (ms) and statuses in order. `rows` are stretches of equal length, `span` in words: the
    shortest of SPANS that needs no more than MOST_SPANS of them, counted from 1970-01-01 00:00 UTC.
    """
    if not began:
        return {"span": "", "rows": []}
    first, last = began[0][0], began[-1][0]
    span = next((ms for ms in SPANS if last // ms - first // ms < MOST_SPANS), max(SPANS))
    starts = range(first // span * span, last + 1, span)
    rows = [{"from_ms": start, "to_ms": start + span, "done": 0, "here": 0, "gone": 0} for start in starts]
    for at_ms, status in began:
        kind = "done" if status == DONE else "here" if status == UNDER_WAY else "gone"
        rows[at_ms // span - first // span][kind] += 1
    return {
        "span": SPANS[span],
        "rows": [row | {"came": row["done"] + row["here"] + row["gone"]} for row in rows],
    }
