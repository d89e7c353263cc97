"""Every kind of stage does what `KINDS` says: in a plan, on its page, in a description, in time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from galley.study.stages.stage import Stage
from galley.study.stages.stage_kinds import STAGE_KINDS, STEP_TYPES
from galley.study.study import Study, load_study
from galley.study.visit.plan import Plan, plan_visit
from galley.study.visit.progress import Progress, Refusal, next_progress
from galley.study.visit.steps import Step
from galley.workspace import frontend_folder
from tests.study.stages.kinds import KINDS
from tests.study.workspaces import study_workspace

BEFORE = """\
format: 1
title: One stage
seed: 11
hat_order: fixed
completion: {code: DONE}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, id: first, questionnaire: before-game}
  - {kind: rounds, id: met, agents: [random, myopic], layouts: [{layout: cramped_room}]}
"""


@pytest.fixture(scope="module", params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def study(kind: str, tmp_path_factory: pytest.TempPathFactory) -> Study:
    stages = [KINDS[kind].line] if kind not in ("consent", "debrief") else []
    lines = "".join(f"  - {line}\n" for line in [*stages, KINDS["debrief"].line])
    return load_study(study_workspace(tmp_path_factory.mktemp("kind") / "w", BEFORE + lines), "mine")


@pytest.fixture(scope="module")
def stage(study: Study, kind: str) -> Stage:
    return next(stage for stage in reversed(study.config.stages) if stage.kind == kind)


@pytest.fixture(scope="module")
def plan(study: Study) -> Plan:
    return plan_visit(study, 1, 0)


@pytest.fixture(scope="module")
def place(plan: Plan, kind: str) -> int:
    return {"consent": 0, "debrief": len(plan.steps) - 1}.get(kind, 4)


@pytest.fixture(scope="module")
def step(plan: Plan, place: int) -> Step:
    return plan.steps[place]


def test_every_kind_is_written_out_and_has_a_page() -> None:
    assert set(KINDS) == {stage.model_fields["kind"].annotation.__args__[0] for stage in STAGE_KINDS}
    pages = {path.stem for path in (Path(frontend_folder()) / "templates").glob("*.html")}
    assert set(STEP_TYPES) - {"screen_out"} <= pages
    assert set(STEP_TYPES) == {kind.step for kind in KINDS.values()}


def test_a_plan_holds_its_step(kind: str, step: Step) -> None:
    stored = step.stored()
    assert stored["kind"] == KINDS[kind].step
    data = {key: value for key, value in stored["data"].items() if key not in ("seed", "seeds", "sha256")}
    assert data == KINDS[kind].stored


def test_a_stored_step_is_read_again(plan: Plan, step: Step, place: int) -> None:
    assert Plan.from_json(plan.to_json()).steps[place] == step
    assert type(Plan.from_json(plan.to_json()).steps[place]) is STEP_TYPES[step.kind]


def test_it_ends_by_what_may_end_it(kind: str, plan: Plan, place: int, step: Step) -> None:
    assert step.ends_visit_as == KINDS[kind].ends_visit_as
    for happening in KINDS[kind].ends(step.id):
        assert isinstance(next_progress(plan, Progress(place), happening), Progress)
    every = {happening for other in KINDS.values() for happening in other.ends(step.id)}
    for happening in every - set(KINDS[kind].ends(step.id)):
        assert isinstance(next_progress(plan, Progress(place), happening), Refusal)


def test_forms_of_its_page_mean_what_they_should(kind: str, step: Step) -> None:
    for form, meant in KINDS[kind].forms:
        assert step.happening(form) == (None if meant is None else meant(step.id))  # type: ignore[call-arg]


def test_its_page_knows_no_more_than_it_may(kind: str, step: Step) -> None:
    told: dict[str, Any] = step.public()
    assert told == KINDS[kind].page


def test_it_is_described_and_takes_its_time(kind: str, study: Study, stage: Stage) -> None:
    assert next(stage.description(study)) == KINDS[kind].tells
    assert stage.seconds(study.config, study.questionnaires) == KINDS[kind].seconds
