"""Rounds as they are set up: who sits where, on which layout, as the plans of their people say."""

from __future__ import annotations

import json
from collections.abc import Mapping

from galley.kitchen import Layout
from galley.records import NewRound, SeatRow, VisitRow
from galley.server.participant.visits import Visit
from galley.study.stages.round_step import RoundStep
from galley.study.visit.plan import Plan


def round_layout(layouts: Mapping[str, Layout], step: RoundStep) -> Layout:
    """The layout of a round, with the round's length as its horizon."""
    return layouts[step.layout].with_rules(horizon_ticks=step.ticks)


def round_at(visit: Visit) -> RoundStep:
    """The round that a visit is at.

    Raises:
        ValueError: it is at another step.
    """
    if visit.round is None:
        raise ValueError(f"step '{visit.step.id}' is no round")
    return visit.round


def of_one(
    layouts: Mapping[str, Layout], visit_id: int, step: RoundStep, agent: str, sha256: str, at_ms: float
) -> NewRound:
    """The round of a visit's step, played with an agent."""
    hat = None if step.partner == "none" else step.partner_hat
    partner = SeatRow(1 - step.human_seat, None, None, agent, sha256, hat)
    return _round(layouts, step, visit_id, partner, at_ms)


def of_two(layouts: Mapping[str, Layout], first: VisitRow, second: VisitRow, at_ms: float) -> NewRound:
    """The round that two visits play at their steps; who is named first gets the seat of their plan.

    Raises:
        ValueError: one of them is at no round.
    """
    step, other = (Plan.from_json(row.plan_json).steps[row.step_index] for row in (first, second))
    if not isinstance(step, RoundStep) or not isinstance(other, RoundStep):
        raise ValueError(f"visits {first.id} and {second.id} are not both at a round")
    sits = SeatRow(1 - step.human_seat, second.id, other.id, hat=other.human_hat)
    return _round(layouts, step, first.id, sits, at_ms)


def _round(
    layouts: Mapping[str, Layout], step: RoundStep, visit_id: int, other: SeatRow, at_ms: float
) -> NewRound:
    layout = round_layout(layouts, step)
    own = SeatRow(step.human_seat, visit_id, step.id, hat=step.human_hat)
    return NewRound(
        step.round_no,
        layout.name,
        json.dumps(layout.to_dict()),
        layout.rules.horizon_ticks,
        step.tick_ms,
        step.seed,
        at_ms,
        (own, other) if step.human_seat == 0 else (other, own),
        step.episodes,
    )
