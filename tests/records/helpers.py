"""Visits and rounds made by hand for the tests of the records."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from galley.kitchen import Kitchen, Layout
from galley.records import (
    Arrival,
    ClockRow,
    KeyRow,
    NewRound,
    PauseRow,
    Planned,
    SeatRow,
    Store,
    TickRow,
    VisitRow,
)
from galley.records.reading.round_replay import state_bytes
from galley.study.stages.round_step import RoundStep
from galley.study.stages.stage_kinds import ComparisonStep, ConsentStep, DebriefStep, Side
from galley.study.visit.plan import Plan
from galley.study.visit.steps import QuestionnaireStep

START_MS = 1_760_000_000_000
TINY = Layout.from_ascii("tiny", "XXPXX\nO  2O\nX1  X\nXDXSX", horizon_ticks=40)


def round_step(step_id: str, title: str, round_no: int, **changes: Any) -> RoundStep:
    """The step of a round as a plan holds it."""
    usual: dict[str, Any] = {
        "round_no": round_no,
        "of": 2,
        "layout": TINY.name,
        "agent": "chef-a",
        "human_seat": 1,
        "human_hat": "blue",
        "partner_hat": "orange",
        "seed": 2**63 + 5,
        "ticks": 40,
        "tick_ms": 50,
        "goal": {"score": 20, "text": "Serve one soup"},
        "tutorial": False,
        "scored": True,
        "skippable": False,
    }
    return RoundStep(id=step_id, title=title, **(usual | changes))


def plan(visit_no: int = 0) -> Plan:
    """A plan with every kind of step the exports tell apart."""
    after = {"questionnaire": "after", "round_no": 1, "partner_hat": "orange", "human_hat": "blue"}
    first, second = Side(hat="orange", agent="chef-a"), Side(hat="yellow", agent="chef-b")
    steps = (
        ConsentStep(id="consent", title="Consent", text="consent", sha256="c" * 64),
        round_step("tutorial", "Practice", 0, tutorial=True, goal=None),
        round_step("rounds-1", "Round 1", 1),
        QuestionnaireStep(id="rounds-1-questions", title="After", **after),
        round_step("rounds-2", "Round 2", 2, agent="chef-b", partner_hat="yellow", human_seat=0),
        ComparisonStep(
            id="comparison",
            title="Compare",
            questionnaire="compare",
            human_hat="blue",
            first=first,
            second=second,
        ),
        DebriefStep(id="debrief", title="Thank you", completion_code="DONE"),
    )
    hats = {"chef-a": "orange", "chef-b": "yellow"}
    return Plan("demo", "d" * 64, visit_no, 7, {"arm": "a"}, hats, steps)


def begin(store: Store, study: str = "demo", **link_params: str) -> VisitRow:
    """A new visit."""
    arrival = Arrival(study, "d" * 64, START_MS, link_params)
    begun = store.begin_visit(arrival, lambda no, _: Planned(2**64 - 1, plan(no).to_json(), {"arm": "a"}))
    visit = begun.result().visit
    assert visit is not None
    return visit


def open_round(store: Store, visit: VisitRow, step_id: str = "rounds-1", layout: Layout = TINY) -> int:
    """The id of the visit's round at a step of `plan`."""
    step = next(step for step in plan().steps if isinstance(step, RoundStep) and step.id == step_id)
    seats = (
        SeatRow(step.human_seat, visit.id, step_id),
        SeatRow(1 - step.human_seat, None, None, step.agent, "a" * 64, step.partner_hat),
    )
    drawn, ticks = json.dumps(layout.to_dict()), layout.rules.horizon_ticks
    new = NewRound(step.round_no, step.layout, drawn, ticks, step.tick_ms, step.seed, START_MS, seats)
    return store.set_up_round(new).result()


def joint_actions(seed: int, ticks: int) -> list[tuple[int, int]]:
    """Random joint actions."""
    return [(int(a), int(b)) for a, b in np.random.default_rng(seed).integers(0, 6, (ticks, 2))]


def tick_rows(actions: Sequence[tuple[int, int]], first: int = 0) -> list[TickRow]:
    """Rows of ticks that were on time."""
    return [
        TickRow(tick, a0, a1, START_MS + 50.0 * tick, 0.5, 3.25, False)
        for tick, (a0, a1) in enumerate(actions, first)
    ]


def play(
    store: Store, round_id: int, actions: Sequence[tuple[int, int]], status: str = "finished"
) -> Kitchen:
    """The kitchen after a round with these joint actions was journalled and ended."""
    kitchen = Kitchen(TINY)
    for a0, a1 in actions:
        kitchen.step(a0, a1)
    store.journal(
        round_id,
        tick_rows(actions),
        [KeyRow(1, "up", True, 10.5, START_MS + 7.25, 0, 1)],
        [PauseRow(3, START_MS + 150.0, START_MS + 650.0, "left")],
        [ClockRow(11.0, START_MS + 8.0, None, 1)],
    )
    end = (kitchen.score, int(kitchen.view.deliveries), START_MS + 2000, state_bytes(kitchen.state))
    assert store.finish_round(round_id, status, *end).result()
    return kitchen


def one_soup() -> list[tuple[int, int]]:
    """Joint actions of 40 ticks in which seat 0 cooks and serves one soup on `TINY` while seat 1 stays."""
    fetch = "NWI" + "ENI" + "WIENI" * 2  # three onions; the last goes in at tick 15, ready after tick 34
    dish = "WSSI" + "NEN"
    serve = "I" + "SES" + "I"
    script = fetch + dish + "." * (35 - len(fetch + dish)) + serve
    return [("NSEW.I".index(letter), 4) for letter in script]
