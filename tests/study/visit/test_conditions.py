"""Ways through a visit that depend on answers, tries and time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.errors import InvalidFiles
from galley.study.study import Study, load_study
from galley.study.visit.happenings import (
    Agreed,
    Continued,
    Ended,
    RoundEnded,
    Skipped,
    Submitted,
    TimedOut,
)
from galley.study.visit.plan import Plan, plan_visit
from galley.study.visit.progress import Progress, Refusal, failed_attention, next_progress, position
from galley.study.written.factors import Condition
from galley.study.written.recruitment import Attention
from tests.study.workspaces import study_workspace

STUDY = """\
format: 1
title: Ways
seed: 3
attention: {allowed: 1, then: end}
completion: {code: DONE, redirect: "https://x.org/?cc={code}&p={PROLIFIC_PID}"}
endings:
  screened_out: {code: OUT, text: debrief}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, id: survey, questionnaire: asked}
  - {kind: screen_out, when: {item: survey.age, at_most: 17}}
  - {kind: instructions, id: novice, text: instructions, when: {item: survey.played, any_of: ["no"]}}
  - {kind: quiz, questionnaire: kitchen-quiz, tries: 2}
  - {kind: break, time_limit_s: 60, at_least_s: 5}
  - {kind: questionnaire, id: load, questionnaire: nasa-tlx, skippable: true, time_limit_s: 90, at_limit: end}
  - kind: rounds
    agents: [random]
    layouts: [{layout: cramped_room}]
    after_each: asked
    when: [{item: survey.age, at_least: 18}, {item: survey.played, none_of: ["maybe"]}]
  - {kind: questionnaire, id: last, questionnaire: asked}
  - {kind: debrief, text: debrief}
"""
ASKED = """\
format: 1
title: Asked
source: made up
items:
  - {id: age, kind: number, text: Age?, min: 0, max: 120}
  - id: played
    kind: single_choice
    text: Played?
    options: [{value: "yes", label: Y}, {value: "no", label: N}, {value: maybe, label: M}]
  - {id: check, kind: likert, text: Take the second., low_label: l, high_label: h, expected: 2}
"""
RIGHT = {"onions": 3, "start": "by-itself", "score": "shared"}


def workspace_study(folder: Path, text: str) -> Study:
    workspace = study_workspace(folder, text)
    (workspace.path / "questionnaires" / "asked.yaml").write_text(ASKED)
    return load_study(workspace, "mine")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return workspace_study(tmp_path_factory.mktemp("ways") / "w", STUDY)


@pytest.fixture(scope="module")
def plan(study: Study) -> Plan:
    return plan_visit(study, 1, 0)


class Visit:
    """A participant who is taken through a plan; every answer is kept."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.progress = Progress()
        self.answers: dict[str, dict[str, Any]] = {}

    @property
    def at(self) -> str:
        return self.plan.steps[self.progress.step_index].id

    def do(self, happening: Any) -> Visit:
        after = next_progress(self.plan, self.progress, happening, self.answers)
        assert isinstance(after, Progress), after
        self.progress = after
        return self

    def answer(self, **answers: Any) -> Visit:
        self.answers[self.at] = answers
        return self.do(Submitted(self.at))

    def to_quiz(self, played: str = "yes") -> Visit:
        self.do(Agreed("consent")).answer(age=20, played=played, check=2)
        return self


def test_a_screen_out_ends_the_visits_that_meet_it(plan: Plan) -> None:
    visit = Visit(plan).do(Agreed("consent")).answer(age=17, played="yes", check=2)
    assert visit.progress.status == "screened_out"
    assert isinstance(next_progress(plan, visit.progress, Submitted("survey"), visit.answers), Refusal)


def test_conditional_stages_are_met_only_by_those_they_are_for(plan: Plan) -> None:
    assert Visit(plan).to_quiz("yes").at == "quiz"
    assert Visit(plan).to_quiz("no").at == "novice"
    visit = Visit(plan).to_quiz("maybe").answer(**RIGHT)
    visit.do(Continued("break")).do(Skipped("load"))
    assert visit.at == "last"
    visit = Visit(plan).to_quiz("yes").answer(**RIGHT).do(Continued("break")).do(Skipped("load"))
    assert visit.at == "rounds-1"
    assert visit.do(RoundEnded("rounds-1", "finished")).at == "rounds-1-questions"
    assert visit.answer(age=1, played="no", check=2).at == "last"
    assert visit.answer(age=1, played="no", check=2).progress.status == "completed"


def test_without_answers_no_condition_holds(plan: Plan) -> None:
    after = next_progress(plan, Progress(1), Submitted("survey"))
    assert isinstance(after, Progress)
    assert plan.steps[after.step_index].id == "quiz"


def test_a_quiz_may_be_tried_again_until_the_tries_are_used_up(plan: Plan) -> None:
    visit = Visit(plan).to_quiz()
    here = visit.progress.step_index
    wrong = {**RIGHT, "onions": 4}
    assert visit.answer(**wrong).progress == Progress(here, "active", 1)
    assert visit.answer(**RIGHT).progress == Progress(here + 1)
    visit = Visit(plan).to_quiz().answer(**wrong).answer(**wrong)
    assert visit.progress == Progress(here, "failed_checks", 2)


def test_a_quiz_may_let_everybody_go_on(tmp_path: Path) -> None:
    study = workspace_study(tmp_path / "w", STUDY.replace("tries: 2", "tries: 1, after_last: go_on"))
    visit = Visit(plan_visit(study, 1, 0)).to_quiz().answer(**{**RIGHT, "score": "mine"})
    assert (visit.at, visit.progress.tries) == ("break", 0)


def test_time_limits_lead_on_or_end_the_visit(plan: Plan) -> None:
    visit = Visit(plan).to_quiz().answer(**RIGHT)
    step = plan.steps[visit.progress.step_index]
    assert (step.time_limit_s, step.at_limit, step.at_least_s) == (60, "go_on", 5)
    assert visit.do(TimedOut("break")).at == "load"
    assert visit.do(TimedOut("load")).progress.status == "timed_out"
    assert isinstance(next_progress(plan, Progress(), TimedOut("consent")), Refusal)


def test_a_visit_may_end_from_outside(plan: Plan) -> None:
    for outcome in ("timed_out", "expired", "partner_missing"):
        assert next_progress(plan, Progress(1), Ended("survey", outcome)) == Progress(1, outcome)  # type: ignore[arg-type]
    for outcome in ("completed", "declined", "screened_out", "failed_checks"):
        assert isinstance(next_progress(plan, Progress(1), Ended("survey", outcome)), Refusal)  # type: ignore[arg-type]


def test_too_many_failed_attention_checks_end_the_visit(plan: Plan) -> None:
    visit = Visit(plan).do(Agreed("consent")).answer(age=20, played="yes", check=5)
    assert visit.at == "quiz"
    assert failed_attention(plan, visit.answers) == (("survey", "check"),)
    visit.answer(**RIGHT).do(Continued("break")).do(Skipped("load")).do(RoundEnded("rounds-1", "finished"))
    assert visit.answer(age=20, played="yes", check=1).progress.status == "failed_checks"
    flagging = replace(plan, attention=Attention(allowed=0, then="flag"))
    again = Visit(flagging).do(Agreed("consent")).answer(age=20, played="yes", check=5)
    assert again.progress.status == "active"


def test_steps_may_not_be_skipped_unless_the_study_says_so(plan: Plan) -> None:
    for index, step in enumerate(plan.steps[:-1]):
        after = next_progress(plan, Progress(index), Skipped(step.id))
        assert isinstance(after, Progress) == (step.id == "load")


def test_the_progress_bar_counts_what_is_met(plan: Plan) -> None:
    visit = Visit(plan)
    assert position(plan, visit.progress, visit.answers) == (1, 10)  # screen_out is no page
    visit.to_quiz("yes")
    assert position(plan, visit.progress, visit.answers) == (3, 9)
    visit.answer(**RIGHT).do(Continued("break")).do(Skipped("load"))
    visit.do(RoundEnded("rounds-1", "finished")).answer(age=1, played="no", check=2)
    visit.answer(age=1, played="no", check=2)
    assert position(plan, visit.progress, visit.answers) == (9, 9)


@given(
    ages=st.integers(0, 120),
    played=st.sampled_from(["yes", "no", "maybe"]),
    fates=st.lists(st.sampled_from(["right", "wrong", "late", "skip"]), max_size=12),
)
def test_every_way_through_ends_and_never_goes_back(
    plan: Plan, ages: int, played: str, fates: list[str]
) -> None:
    visit = Visit(plan).do(Agreed("consent"))
    at, of = 0, 0
    for fate in [*fates, *["right"] * 20]:
        if visit.progress.status != "active":
            break
        step = plan.steps[visit.progress.step_index]
        before = visit.progress.step_index
        at, of = position(plan, visit.progress, visit.answers)
        assert 1 <= at <= of
        if fate == "skip" and step.skippable:
            visit.do(Skipped(step.id))
        elif fate == "late" and step.time_limit_s is not None:
            visit.do(TimedOut(step.id))
        elif step.kind == "quiz":
            visit.answer(**({**RIGHT, "onions": 9} if fate == "wrong" else RIGHT))
        elif step.kind == "questionnaire":
            visit.answer(age=ages, played=played, check=3 if fate == "wrong" else 2)
        elif step.kind == "round":
            visit.do(RoundEnded(step.id, "abandoned"))
        else:
            visit.do(Continued(step.id))
        assert visit.progress.step_index >= before
    assert visit.progress.status in ("completed", "screened_out", "failed_checks", "timed_out")
    if visit.progress.status == "completed":
        assert visit.progress.step_index == len(plan.steps) - 1
        assert ages > 17


@pytest.mark.parametrize(
    ("condition", "value", "wanted"),
    [
        ({"any_of": ["a", "b"]}, "b", True),
        ({"any_of": ["a", "b"]}, "c", False),
        ({"any_of": ["a"]}, ["c", "a"], True),
        ({"none_of": ["a"]}, ["c", "a"], False),
        ({"none_of": ["a"]}, "b", True),
        ({"none_of": ["a"]}, None, False),
        ({"none_of": ["a"]}, [], False),
        ({"at_least": 3}, 3, True),
        ({"at_least": 3, "at_most": 4}, 5, False),
        ({"at_least": 3}, "text", False),
        ({"any_of": [3]}, 3.0, True),
    ],
)
def test_conditions_hold_as_told(condition: dict[str, Any], value: object, wanted: bool) -> None:
    assert Condition.model_validate({"item": "a.b", **condition}).holds(value) is wanted


def test_endings_have_codes_and_filled_in_addresses(study: Study) -> None:
    done = study.ending("completed", {"PROLIFIC_PID": "a b&c"})
    assert (done.code, done.redirect) == ("DONE", "https://x.org/?cc=DONE&p=a%20b%26c")
    assert study.ending("completed", {}).redirect == "https://x.org/?cc=DONE&p="
    out = study.ending("screened_out", {})
    assert (out.code, out.redirect, out.text) == ("OUT", None, "debrief")
    assert study.ending("expired", {}).code is None


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        (
            "survey.age, at_most",
            "survey.aeg, at_most",
            11,
            "stage 'survey' asks for no item 'aeg'; did you mean 'age'",
        ),
        (
            "survey.age, at_most: 17",
            "last.age, at_most: 17",
            11,
            "no stage before this one that asks questions",
        ),
        ('any_of: ["no"]}}', "any_of: [never]}}", 12, "'never' is no option of 'played'"),
        (
            'survey.played, any_of: ["no"]',
            "survey.played, at_least: 3",
            12,
            "the answer to 'played' is no number",
        ),
        ('any_of: ["no"]}}', 'any_off: ["no"]}}', 12, "key 'any_off' is unknown"),
        (
            "when: {item: survey.age, at_most: 17}",
            "when: {item: survey.age}",
            11,
            "says nothing about the answer",
        ),
        ("when: {item: survey.age, at_most: 17}", "when: []", 11, "ends the visit of everybody"),
        (
            "questionnaire: kitchen-quiz",
            "questionnaire: nasa-tlx",
            13,
            "no item of questionnaire 'nasa-tlx' has a right",
        ),
        ("&p={PROLIFIC_PID}", "&p={PROLIFIC}", 5, "'{PROLIFIC}' in the address is no parameter that is kept"),
    ],
)
def test_conditions_on_what_is_not_asked_are_told(
    tmp_path: Path, old: str, new: str, line: int, words: str
) -> None:
    assert old in STUDY
    with pytest.raises(InvalidFiles) as caught:
        workspace_study(tmp_path / "w", STUDY.replace(old, new))
    told = [str(problem) for problem in caught.value.problems]
    assert any(words in one and one.startswith(f"studies/mine.yaml:{line}:") for one in told), told
