"""Rounds as they are set up: who sits where, on which layout, as the plans of their people say."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from galley.kitchen import Layout
from galley.records import NewRound, SeatRow, VisitRow
from galley.study.visit.plan import Plan, Step


def round_layout(layouts: Mapping[str, Layout], data: Mapping[str, Any]) -> Layout:
    """The layout of a round step, with the round's length as its horizon."""
    return layouts[data["layout"]].with_rules(horizon_ticks=data["ticks"])


def of_one(
    layouts: Mapping[str, Layout], visit_id: int, step: Step, agent: str, sha256: str, at_ms: float
) -> NewRound:
    """The round of a visit's step, played with an agent."""
    seat = int(step.data["human_seat"])
    hat = None if step.data["partner"] == "none" else step.data["partner_hat"]
    partner = SeatRow(1 - seat, None, None, agent, sha256, hat)
    return _round(layouts, step, visit_id, partner, at_ms)


def of_two(layouts: Mapping[str, Layout], first: VisitRow, second: VisitRow, at_ms: float) -> NewRound:
    """The round that two visits play at their steps; who is named first gets the seat of their plan."""
    step, other = (Plan.from_json(row.plan_json).steps[row.step_index] for row in (first, second))
    seat = 1 - int(step.data["human_seat"])
    return _round(
        layouts, step, first.id, SeatRow(seat, second.id, other.id, hat=other.data["human_hat"]), at_ms
    )


def _round(
    layouts: Mapping[str, Layout], step: Step, visit_id: int, other: SeatRow, at_ms: float
) -> NewRound:
    data = step.data
    layout = round_layout(layouts, data)
    seat = int(data["human_seat"])
    own = SeatRow(seat, visit_id, step.id, hat=data["human_hat"])
    return NewRound(
        data["round_no"],
        layout.name,
        json.dumps(layout.to_dict()),
        layout.rules.horizon_ticks,
        data["tick_ms"],
        data["seed"],
        at_ms,
        (own, other) if seat == 0 else (other, own),
        data["episodes"],
    )
