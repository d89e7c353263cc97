"""Reads: rows of the database as the frozen rows of `galley.records.rows`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table, select

from galley.errors import GalleyError
from galley.records.database.tables import (
    RESPONSES,
    ROUNDS,
    SEATS,
    STAND_INS,
    STUDIES,
    TICKS,
    VISITS,
    StudyState,
)
from galley.records.rows import RoundRow, SeatRow, StandInRow, VisitRow


def studies(connection: Connection) -> tuple[str, ...]:
    """The names of all studies that were visited, sorted."""
    return tuple(connection.execute(select(VISITS.c.study).distinct().order_by(VISITS.c.study)).scalars())


def seconds_between(start_ms: float, end_ms: float | None) -> float | None:
    """How long something took; None if it is not over, or the clock was set back in between."""
    return None if end_ms is None or end_ms < start_ms else (end_ms - start_ms) / 1000


def must_know(connection: Connection, database: str, study: str) -> None:
    """Make sure that somebody visited the study.

    Raises:
        GalleyError: nobody did; it names the studies there are.
    """
    known = studies(connection)
    if study not in known:
        there = f"it has {', '.join(known)}" if known else "nobody has visited any study"
        raise GalleyError(f"{database}: holds no visit of study {study!r}; {there}")


def visit(connection: Connection, token: str) -> VisitRow | None:
    """The visit with this token."""
    found = connection.execute(select(VISITS).where(VISITS.c.token == token)).mappings().one_or_none()
    return None if found is None else visit_row(dict(found))


def study_state(connection: Connection, study: str) -> StudyState:
    """Whether a study takes new visits; one that nobody visited is open."""
    return connection.execute(select(STUDIES.c.state).where(STUDIES.c.name == study)).scalar() or "open"


def answers(connection: Connection, visit_id: int) -> dict[str, dict[str, Any]]:
    """For each step of a visit that was answered, its answers by item, in the order of the page."""
    columns = (RESPONSES.c.step_id, RESPONSES.c.item, RESPONSES.c.value)
    query = select(*columns).where(RESPONSES.c.visit_id == visit_id)
    found: dict[str, dict[str, Any]] = {}
    for step_id, item, value in connection.execute(query.order_by(RESPONSES.c.at_ms, RESPONSES.c.position)):
        found.setdefault(step_id, {})[item] = value
    return found


def visits(connection: Connection, study: str, tests: bool = True) -> Iterator[VisitRow]:
    """Every visit of a study in order of arrival, one at a time; `tests` says whether to give tests too."""
    query = select(VISITS.c.id).where(VISITS.c.study == study)
    ids = connection.execute(
        (query if tests else query.where(~VISITS.c.test)).order_by(VISITS.c.visit_no)
    ).scalars()
    for visit_id in ids.all():
        yield visit_row(
            dict(connection.execute(select(VISITS).where(VISITS.c.id == visit_id)).mappings().one())
        )


def visit_row(values: dict[str, Any]) -> VisitRow:
    """A VisitRow of one row of the table."""
    return VisitRow(**{**values, "seed": int(values["seed"])})


def round_of(connection: Connection, visit_id: int, step_id: str) -> RoundRow | None:
    """The round that a visit plays at a step."""
    found = connection.execute(
        select(SEATS.c.round_id).where(SEATS.c.visit_id == visit_id, SEATS.c.step_id == step_id)
    ).scalar_one_or_none()
    return None if found is None else round_row(connection, found)


def met_somebody(connection: Connection, visit_id: int, steps: Sequence[str]) -> bool:
    """Whether a visit was in a round with another person at one of these steps."""
    rounds = (round_of(connection, visit_id, step) for step in steps)
    return any(row is not None and all(seat.agent is None for seat in row.seats) for row in rounds)


def rounds_of_visit(connection: Connection, visit_id: int) -> list[int]:
    """The ids of a visit's rounds in the order they were set up."""
    query = select(SEATS.c.round_id).where(SEATS.c.visit_id == visit_id).order_by(SEATS.c.round_id)
    return list(connection.execute(query).scalars())


def rounds_of_study(connection: Connection, study: str) -> list[int]:
    """The ids of a study's rounds in the order they were set up."""
    return list(
        connection.execute(select(ROUNDS.c.id).where(ROUNDS.c.study == study).order_by(ROUNDS.c.id)).scalars()
    )


def round_row(connection: Connection, round_id: int) -> RoundRow:
    """The round with this id and its joint actions.

    Raises:
        GalleyError: there is none.
    """
    found = connection.execute(select(ROUNDS).where(ROUNDS.c.id == round_id)).mappings().one_or_none()
    if found is None:
        raise GalleyError(f"there is no round {round_id}")
    seats = connection.execute(
        select(SEATS).where(SEATS.c.round_id == round_id).order_by(SEATS.c.seat)
    ).mappings()
    return RoundRow(
        **{**found, "seed": int(found["seed"])},
        seats=tuple(SeatRow(**{name: row[name] for name in SeatRow.__slots__}) for row in seats),
        joint_actions=joint_actions(connection, round_id),
        stand_ins=tuple(
            StandInRow(**{name: row[name] for name in StandInRow.__slots__})
            for row in of_round(connection, STAND_INS, round_id)
        ),
    )


def joint_actions(connection: Connection, round_id: int) -> NDArray[np.uint8]:
    """The joint actions of a round in order, uint8 [T, 2]."""
    query = (
        select(TICKS.c.action_0, TICKS.c.action_1).where(TICKS.c.round_id == round_id).order_by(TICKS.c.tick)
    )
    pairs = [tuple(row) for row in connection.execute(query)]
    return np.array(pairs, dtype=np.uint8).reshape(-1, 2)


def participants(connection: Connection, row: RoundRow) -> dict[int, str]:
    """The name in exports of the person at each seat that has one."""
    seats = {seat.visit_id: seat.seat for seat in row.seats if seat.visit_id is not None}
    query = select(VISITS.c.id, VISITS.c.participant).where(VISITS.c.id.in_(seats))
    return {seats[visit_id]: participant for visit_id, participant in connection.execute(query)}


def of_round(connection: Connection, table: Table, round_id: int) -> list[dict[str, Any]]:
    """The rows of a round in a table keyed by round, in the order of its key."""
    query = select(table).where(table.c.round_id == round_id).order_by(*table.primary_key.columns)
    return [dict(row) for row in connection.execute(query).mappings()]
