"""A visit as the study itself plans it, through the store and out again."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from galley.kitchen import Kitchen
from galley.records import Arrival, Planned, Store
from galley.records.export.study_export import export_study
from galley.records.reading.round_replay import state_bytes
from galley.records.reading.verify import verify_study
from galley.server.rounds.set_up import of_one
from galley.study.study import load_study
from galley.study.visit.plan import plan_visit, visit_seed
from galley.study.visit.steps import QuestionsStep
from galley.study.written.questionnaire import validate_answers
from tests.records.helpers import START_MS, tick_rows
from tests.study.workspaces import short_workspace


def filled(items: tuple[object, ...]) -> dict[str, list[str]]:
    """A form on which everything is answered."""
    form = {}
    for item in items:
        kind = item.kind  # type: ignore[attr-defined]
        if kind in ("likert", "comparison"):
            form[item.id] = ["2"]  # type: ignore[attr-defined]
        elif kind in ("single_choice", "multiple_choice"):
            form[item.id] = [item.options[0].value]  # type: ignore[attr-defined]
        elif kind == "number":
            form[item.id] = [f"{item.min:g}"]  # type: ignore[attr-defined]
        else:
            form[item.id] = ["words"]  # type: ignore[attr-defined]
    return form


def test_a_planned_visit_goes_through_the_records(tmp_path: Path) -> None:
    study = load_study(short_workspace(tmp_path / "workspace"), "short")
    plan = plan_visit(study, visit_seed(study, 0), 0)
    compared = 0
    with Store.open(tmp_path / "galley.sqlite") as store:
        planned = Planned(plan.visit_seed, plan.to_json(), plan.condition)
        arrival = Arrival(study.name, study.sha256, START_MS)
        visit = store.begin_visit(arrival, lambda *_: planned).result().visit
        assert visit is not None
        for place, step in enumerate(plan.steps):
            now = START_MS + 10_000 * place
            store.enter_step(visit.id, step.id, now).result()
            answers, asked = {}, None
            if isinstance(step, QuestionsStep):
                asked = study.questionnaires[step.questionnaire]
                answers, problems = validate_answers(asked, filled(asked.items))
                assert not problems
                compared += step.kind == "comparison"
            if step.kind == "round":
                layout = study.layouts[step.layout].with_rules(horizon_ticks=step.ticks)
                new = of_one({step.layout: layout}, visit.id, step, step.agent, "a" * 64, now)
                round_id = store.set_up_round(new).result()
                actions = np.random.default_rng(place).integers(0, 6, (step.ticks, 2)).tolist()
                kitchen = Kitchen(layout)
                for a0, a1 in actions:
                    kitchen.step(a0, a1)
                store.journal(round_id, tick_rows(actions))
                deliveries, last = int(kitchen.view.deliveries), state_bytes(kitchen.state)
                store.finish_round(round_id, "finished", kitchen.score, deliveries, now, last).result()
            following = min(place + 1, len(plan.steps) - 1)
            store.save_answers(
                visit.id, step.id, answers, following, "active", now + 500, questionnaire=asked
            ).result()
        assert verify_study(store, study.name).ok
        export_study(store, study.name, tmp_path / "out")
    found = {
        name: list(
            csv.DictReader((tmp_path / "out" / f"{name}.csv").read_text(encoding="utf-8").splitlines())
        )
        for name in ("stages", "rounds", "responses", "ticks")
    }
    assert [row["step"] for row in found["stages"]] == [step.id for step in plan.steps]
    rounds = [step for step in plan.steps if step.kind == "round"]
    assert [(row["step"], row["agent"], row["replays"]) for row in found["rounds"]] == [
        (step.id, step.agent, "true") for step in rounds
    ]
    assert len(found["ticks"]) == sum(step.ticks for step in rounds)
    assert compared
    for row in found["responses"]:
        assert row["text"]
        if row["kind"] == "comparison":
            assert row["preferred_agent"] == row["first_agent"] != ""
        if row["step"].endswith("-questions"):
            assert row["agent"] in plan.hats
            assert row["partner_hat"] == plan.hats[row["agent"]]
