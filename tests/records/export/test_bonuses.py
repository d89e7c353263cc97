"""What rounds and visits earned, in the exports and as a file to pay from (D9)."""

from __future__ import annotations

from pathlib import Path

from galley.records import Arrival, Planned, Store, VisitRow
from galley.records.export.bonus_payments import export_bonuses
from galley.records.export.study_export import export_study
from galley.study.stages.round_step import Bonus
from galley.study.visit.condition_slots import allocate
from galley.study.visit.plan import Plan
from tests.records.export.test_formats import read_csv
from tests.records.helpers import START_MS, one_soup, open_round, plan, play

AMOUNTS = {"rounds-1": 0.5, "rounds-2": 0.25}


def begin(store: Store, person: str | None) -> VisitRow:
    """A visit whose two rounds have bonuses of 0.5 and 0.25 GBP."""
    bonuses = {step: {"bonus": Bonus(amount=amount, unit="GBP")} for step, amount in AMOUNTS.items()}
    steps = tuple(step.model_copy(update=bonuses.get(step.id, {})) for step in plan().steps)
    text = Plan("demo", "d" * 64, 0, 7, {"arm": "a"}, {}, steps).to_json()
    came = store.begin_visit(
        Arrival("demo", "d" * 64, START_MS, {}, "en", person),
        lambda visit_no, slot: Planned(7, text, {"arm": "a"}),
        lambda slots: allocate(slots, START_MS, 1e9, None),
    ).result()
    assert came.visit is not None
    return came.visit


def test_d9_what_was_earned_is_told_and_can_be_paid(store: Store, tmp_path: Path) -> None:
    both, one, none, unknown = (begin(store, person) for person in ("5f3a", "=6b", "7c", None))
    play(store, open_round(store, both), one_soup())
    play(store, open_round(store, both, "rounds-2"), one_soup())
    play(store, open_round(store, one), one_soup())
    play(store, open_round(store, one, "rounds-2"), one_soup()[:11], "abandoned")
    play(store, open_round(store, none), one_soup()[:11], "abandoned")
    play(store, open_round(store, unknown, "rounds-2"), one_soup())
    export_study(store, "demo", tmp_path, ("csv", "jsonl"))
    rounds = [(float(row["bonus"]), row["bonus_unit"]) for row in read_csv(tmp_path / "rounds.csv")]
    assert rounds == [(amount, "GBP") for amount in (0.5, 0.25, 0.5, 0.0, 0.0, 0.25)]
    visits = [(float(row["bonus"]), row["bonus_unit"]) for row in read_csv(tmp_path / "participants.csv")]
    assert visits == [(amount, "GBP") for amount in (0.75, 0.5, 0.0, 0.25)]
    assert export_bonuses(store, "demo", tmp_path / "bonuses.csv") == 2
    assert (tmp_path / "bonuses.csv").read_text(encoding="utf-8") == "5f3a,0.75\n=6b,0.50\n"
