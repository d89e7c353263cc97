"""The wide sheet: one row per visit, a column for everything that anybody was asked or played."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from sqlalchemy import Connection, select

from galley.records.database.tables import QUESTIONS
from galley.records.export.columns import ROUND_COLUMNS, WIDE, Field
from galley.records.rows import RoundRow, VisitRow
from galley.records.store.visit_writes import question_of, subscale_of


class Wide:
    """The columns of a study's wide sheet. They depend on what was asked, not on whose answers are left."""

    def __init__(self, connection: Connection, study: str) -> None:
        query = select(QUESTIONS).where(QUESTIONS.c.study == study)
        order = (QUESTIONS.c.place, QUESTIONS.c.position, QUESTIONS.c.step_id, QUESTIONS.c.item)
        rows = connection.execute(query.order_by(*order)).all()
        self._factors = [row.item for row in rows if not row.step_id]
        asked = [(row.step_id, row.item) for row in rows if row.step_id]
        self._means = [(step, subscale_of(item)) for step, item in asked if subscale_of(item)]
        self._steps = [(step, item) for step, item in asked if not subscale_of(item)]
        fields = [Field(f"condition.{factor}", "text", "level of the factor") for factor in self._factors]
        for step, item in self._steps:
            if item:
                fields.append(Field(f"{step}.{item}", "text", "the answer"))
            else:
                fields += [Field(f"{step}.{one.name}", one.kind, one.meaning) for one in ROUND_COLUMNS]
        fields += [
            Field(f"{step}.{question_of(subscale)}", "number", "mean of the subscale")
            for step, subscale in self._means
        ]
        self.sheet = replace(WIDE, fields=(*WIDE.fields, *fields))

    def row(
        self,
        visit: VisitRow,
        answers: Mapping[str, Mapping[str, Any]],
        rounds: Mapping[str, RoundRow],
        told: Mapping[str, Mapping[str, Any]],
        means: Mapping[str, Mapping[str, float | None]],
    ) -> dict[str, Any]:
        """A visit's values in these columns.

        `rounds`, and what else is `told` of them, come by step, `means` by step and subscale.
        """
        values: dict[str, Any] = {f"condition.{name}": visit.condition.get(name) for name in self._factors}
        for step, item in self._steps:
            if item:
                values[f"{step}.{item}"] = answers.get(step, {}).get(item)
            else:
                found = _of(visit, rounds[step]) | dict(told[step]) if step in rounds else {}
                values |= {f"{step}.{one.name}": found.get(one.name) for one in ROUND_COLUMNS}
        for step, subscale in self._means:
            values[f"{step}.{question_of(subscale)}"] = means.get(step, {}).get(subscale)
        return values


def _of(visit: VisitRow, row: RoundRow) -> dict[str, Any]:
    agent = next(seat.agent for seat in row.seats if seat.visit_id != visit.id)
    same = ("layout", "status", "score", "deliveries")
    return {"agent": agent, **{name: getattr(row, name) for name in same}}
