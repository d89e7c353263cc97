"""Minutes and rounds in texts are those that a visit meets, in every condition of a study (D1)."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from galley.study.describe import describe
from galley.study.estimate import in_figures
from galley.study.stages.round_step import RoundStep
from galley.study.stages.rounds import ROUND_EXTRA_S
from galley.study.stages.stage import ITEM_S
from galley.study.study import Study, load_study
from galley.study.visit.plan import Plan, plan_visit, visit_seed
from galley.study.visit.steps import QuestionsStep, Step
from galley.workspace import Workspace
from tests.study.workspaces import ROOT, study_workspace

BRANCHES = """\
format: 1
title: Branches
seed: 3
factors:
  score: {levels: ["yes", "no", "short"]}
  asked: {levels: [after-round, before-game]}
completion: {code: DONE}
stages:
  - {kind: consent, text: told}
  - {kind: rounds, id: a, agents: [stay], when: {factor: score, any_of: ["yes"]}, layouts: [LAYOUTS]}
  - {kind: rounds, id: b, agents: [stay, random], when: {factor: score, any_of: ["no"]}, layouts: [LAYOUTS]}
  - kind: rounds
    id: c
    agents: [stay]
    after_each: $asked
    layouts: [{layout: cramped_room, horizon_ticks: 200}, {layout: coordination_ring}]
  - {kind: questionnaire, id: last, questionnaire: $asked}
  - {kind: break, when: {factor: score, none_of: ["yes"]}, time_limit_s: 30}
  - {kind: debrief, text: debrief}
""".replace("LAYOUTS", "{layout: cramped_room}, {layout: coordination_ring}, {layout: forced_coordination}")
ASKED = """
  - {kind: questionnaire, id: more, questionnaire: before-game}
  - {kind: rounds, id: d, agents: [stay], when: {item: more.age, at_least: 30}, layouts: [{layout: simple}]}
  - {kind: debrief"""
SAID = "# Told\n\nMinutes {minutes}, rounds {rounds}, seconds {round_s}.\n"
GUESSED = {"consent": 60.0, "instructions": 90.0, "break": 60.0, "debrief": 20.0}


def branches(folder: Path, study: str = BRANCHES) -> Study:
    workspace = study_workspace(folder / "w", study)
    (workspace.path / "questionnaires" / "texts" / "told.md").write_text(SAID, encoding="utf-8")
    return load_study(workspace, "mine")


def seconds(study: Study, step: Step) -> float:
    """What a step takes by the guesses of its kind, whatever stage it came from."""
    guess = GUESSED.get(step.kind, 0.0)
    if isinstance(step, RoundStep):
        return step.seconds + study.config.countdown_s + ROUND_EXTRA_S
    if isinstance(step, QuestionsStep):
        guess = ITEM_S * len(study.questionnaires[step.questionnaire].items)
    return min(guess, step.time_limit_s or math.inf)


def meets(study: Study, plan: Plan) -> dict[str, tuple[int, int]]:
    """The numbers of a visit, counted over its steps, those that answers decide left out for the least."""
    both = []
    for steps in ([step for step in plan.steps if not step.when], plan.steps):
        minutes = max(1, math.ceil(sum(seconds(study, step) for step in steps) / 60))
        rounds = [step for step in steps if isinstance(step, RoundStep) and not step.tutorial]
        both.append((study.config.minutes or minutes, len(rounds)))
    lengths = [
        round(step.seconds) for step in plan.steps if isinstance(step, RoundStep) and not step.tutorial
    ]
    return {
        "minutes": (both[0][0], both[1][0]),
        "rounds": (both[0][1], both[1][1]),
        "round_s": (min(lengths), max(lengths)),
    }


def agrees(study: Study) -> list[Plan]:
    """A visit of every condition, told what it meets; all of them are what the landing page is told."""
    plans: dict[tuple[str, ...], Plan] = {}
    for slot in range(60 * len(study.config.conditions())):
        plan = plan_visit(study, visit_seed(study, slot), slot)
        plans.setdefault(tuple(plan.condition.values()), plan)
        if len(plans) == len(study.config.conditions()):
            break
    assert len(plans) == len(study.config.conditions()) or any(
        factor.assign == "latin_square" for factor in study.config.factors.values()
    )
    found = []
    for plan in plans.values():
        met = meets(study, plan)
        mine = study.met_by(plan.condition)
        assert dict(mine.quoted.numbers) == met, plan.condition
        step = plan.steps[0].stored()["data"]
        assert step["sha256"] == mine.texts[step["text"]].sha256
        found.append(met)
    for name, (least, most) in study.quoted.numbers.items():
        assert (least, most) == (min(met[name][0] for met in found), max(met[name][1] for met in found)), name
    return list(plans.values())


@pytest.mark.parametrize("name", Workspace(ROOT).names("studies"))
def test_d1_every_shipped_study_tells_what_its_visits_meet(name: str) -> None:
    study = load_study(Workspace(ROOT), name)
    for code in study.languages:
        agrees(study.in_language(code))


def test_d1_visits_of_three_branches_are_told_what_each_of_them_meets(tmp_path: Path) -> None:
    study = branches(tmp_path)
    plans = agrees(study)
    rounds = {}
    for plan in plans:
        mine = study.met_by(plan.condition)
        met = meets(study, plan)
        words = f"Minutes {in_figures(*met['minutes'])}, rounds {met['rounds'][0]}, seconds 30\u201360."
        assert mine.texts["told"].html == f"<p>{words}</p>\n"
        rounds[plan.condition["score"]] = met["rounds"][0]
    assert rounds == {"yes": 5, "no": 8, "short": 2}
    least, most = study.quoted.numbers["minutes"]
    assert f"Minutes {least}\u2013{most}, rounds 2\u20138, seconds 30\u201360." in study.texts["told"].html
    assert study.minutes_told == f"{least}\u2013{most}"
    assert describe(study).startswith(f"mine: Branches, about {least} to {most} minutes, 2 to 8 rounds\n")


def test_d1_stages_that_answers_decide_make_a_least_and_a_most(tmp_path: Path) -> None:
    study = branches(tmp_path, BRANCHES.replace("\n  - {kind: debrief", ASKED))
    agrees(study)
    short = next(c for c in study.config.conditions() if c["score"] == "short")
    assert study.met_by(short).quoted.numbers["rounds"] == (2, 3)
    assert "rounds 2\u20133," in study.met_by(short).texts["told"].html


def test_d1_a_visit_of_a_condition_that_the_file_does_not_have_any_more_reads_on(tmp_path: Path) -> None:
    study = branches(tmp_path)
    for gone in ({}, {"score": "gone", "asked": "after-round"}, {"other": "x"}):
        assert study.met_by(gone).texts == study.texts
