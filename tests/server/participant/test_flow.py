"""The rules of a study's flow, kept by the server: slots, persons, languages, quizzes, time, endings."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import Connection

from galley.records import VisitRow
from galley.records.database.tables import STAGES, VISITS
from galley.study.study import load_study
from tests.records.stored import stored_answers, stored_visit
from tests.server.helpers import Participant, Served, serving
from tests.study.workspaces import study_workspace

FLOW = """
format: 1
title: {en: Soup together, zh: 一起煮汤}
languages: [en, zh]
seed: 5
quota: 2
slot_expires_min: 600
recruitment: {participant: PROLIFIC_PID}
completion: {code: DONE-1, redirect: "https://example.org/back?cc={code}&pid={PROLIFIC_PID}"}
endings:
  declined: {code: NO-1}
  screened_out: {code: OUT-1, redirect: "https://example.org/out?pid={PROLIFIC_PID}"}
  failed_checks: {code: FAIL-1}
factors:
  partner: {levels: [random, stay]}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, id: gate, questionnaire: gate}
  - {kind: screen_out, id: out, when: [{item: gate.age, any_of: ["young"]}]}
  - {kind: quiz, id: quiz, questionnaire: quiz, tries: 3, after_last: end, text: instructions}
  - kind: questionnaire
    id: extra
    questionnaire: gate
    skippable: true
    when: [{item: gate.extra, any_of: ["yes"]}]
  - {kind: break, id: rest, at_least_s: 2}
  - {kind: questionnaire, id: quick, questionnaire: gate, time_limit_s: 2}
  - {kind: questionnaire, id: strict, questionnaire: gate, time_limit_s: 300, at_limit: end}
  - {kind: debrief, text: debrief}
"""
GATE = """
format: 1
title: {en: Before, zh: 之前}
source: made for tests
items:
  - id: age
    kind: single_choice
    text: {en: How old are you?, zh: 你多大了?}
    options: [{value: young, label: {en: Young, zh: 小}}, {value: old, label: {en: Old, zh: 大}}]
  - id: extra
    kind: single_choice
    text: {en: More?, zh: 更多?}
    options: [{value: "no", label: {en: "No", zh: 不}}, {value: "yes", label: {en: "Yes", zh: 是}}]
"""
QUIZ = """
format: 1
title: {en: Check, zh: 检查}
source: made for tests
items:
  - id: onions
    kind: single_choice
    text: {en: How many onions?, zh: 几个?}
    hint: {en: Count them., zh: 数一数。}
    expected: "3"
    options: [{value: "2", label: "2"}, {value: "3", label: "3"}, {value: "4", label: "4"}]
"""
OLD = {"age": "old", "extra": "no"}


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("flow")
    workspace = study_workspace(folder / "lab", FLOW)
    for name, text in (("gate", GATE), ("quiz", QUIZ)):
        (workspace.path / "questionnaires" / f"{name}.yaml").write_text(text, encoding="utf-8")
    invited = FLOW.replace("{participant: PROLIFIC_PID}", "{invitations: friends}").replace("quota: 2\n", "")
    invited = re.sub(r"redirect: \"[^\"]*\"", 'redirect: "https://example.org/"', invited)
    (workspace.path / "studies" / "invited.yaml").write_text(invited, encoding="utf-8")
    (workspace.path / "invitations").mkdir()
    (workspace.path / "invitations" / "friends.txt").write_text("abc-123\nabc-124\n")
    timed = invited.replace("{invitations: friends}", "{}").replace("seed: 5", "seed: 6\nvisit_limit_min: 1")
    (workspace.path / "studies" / "timed.yaml").write_text(timed, encoding="utf-8")
    with serving(workspace, folder / "records.sqlite") as up:
        yield up


def row_of(person: Participant) -> VisitRow:
    row = stored_visit(person.served.store, person.token)
    assert row is not None
    return row


def earlier(served: Served, token: str, seconds: float) -> None:
    """Let everything about a visit have happened so much earlier."""

    def shift(connection: Connection) -> None:
        ms = round(seconds * 1000)
        visit = (
            VISITS.select().with_only_columns(VISITS.c.id).where(VISITS.c.token == token).scalar_subquery()
        )
        connection.execute(
            STAGES.update().where(STAGES.c.visit_id == visit).values(entered_ms=STAGES.c.entered_ms - ms)
        )
        connection.execute(
            VISITS.update()
            .where(VISITS.c.token == token)
            .values(created_ms=VISITS.c.created_ms - ms, last_seen_ms=VISITS.c.last_seen_ms - ms)
        )

    served.store.write(shift).result()


def at_the_quiz(served: Served, pid: str, study: str = "mine") -> Participant:
    person = Participant(served, study, f"?PROLIFIC_PID={pid}")
    person.agree()
    person.submit(OLD)
    assert person.stage == "quiz"
    return person


def test_a_person_comes_back_to_the_visit_that_they_have_and_a_full_study_closes(served: Served) -> None:
    first = Participant(served, query="?PROLIFIC_PID=one&utm=spam")
    assert row_of(first).link_params == {"PROLIFIC_PID": "one"}
    assert first.agree().status_code == 200
    again = Participant(served, query="?PROLIFIC_PID=one")
    assert (again.path, again.stage) == (first.path, "questionnaire")
    others = [Participant(served, query=f"?PROLIFIC_PID={name}") for name in ("two", "three", "four")]
    conditions = [row_of(person).condition["partner"] for person in (first, *others)]
    assert sorted(conditions) == ["random", "random", "stay", "stay"]
    http = served.client()
    late = http.post("/s/mine/begin?PROLIFIC_PID=five")
    assert 'data-stage="ending"' in late.text
    assert "try again later" in late.text
    others[0].submit({"choice": "decline"})
    assert "NO-1" in others[0].page.text
    heir = Participant(served, query="?PROLIFIC_PID=five")
    assert heir.stage == "consent"
    assert row_of(heir).condition == row_of(others[0]).condition
    assert "later" in http.post("/s/mine/begin?PROLIFIC_PID=six").text
    # Those who are in may go on while the study is paused or closed, others may not begin.
    for state in ("paused", "closed"):
        served.store.set_study_state("mine", state, 0).result()
        assert f"study is {state}" in http.get("/s/mine").text
        assert Participant(served, query="?PROLIFIC_PID=one").path == first.path
        assert f"study is {state}" in http.post("/s/mine/begin").text
    served.store.set_study_state("mine", "open", 0).result()
    # A visit that was away too long gives its slot to the next, and is told so when it is back.
    earlier(served, others[1].token, 601 * 60)
    assert Participant(served, query="?PROLIFIC_PID=seven").stage == "consent"
    others[1].load()
    assert others[1].stage == "ending"
    assert "expired" in others[1].page.text
    assert others[1].submit({"choice": "agree"}, step="consent").status_code == 200
    assert row_of(others[1]).status == "expired"


def test_consent_is_kept_with_the_hash_of_its_text_in_the_language_chosen(served: Served) -> None:
    http = served.client()
    landing = http.get("/s/timed?x=1", headers={"accept-language": "zh-CN,en;q=0.5"}).text
    assert 'lang="zh"' in landing
    assert "一起煮汤" in landing
    assert 'href="/s/timed?x=1&amp;language=en"' in landing
    assert 'lang="en"' in http.get("/s/timed?language=en", headers={"accept-language": "zh"}).text
    person = Participant(served, "timed", language="zh")
    assert 'lang="zh"' in person.page.text
    person.agree()
    study = load_study(served.workspace, "timed").in_language("zh")
    assert row_of(person).consent_sha256 == study.texts["consent"].sha256
    assert row_of(person).language == "zh"
    assert "你多大了" in person.page.text
    page = person.submit({"age": "old"})
    assert page.status_code == 422
    assert "请" in page.text
    assert Participant(served, "timed", language="xx").stage == "consent"


def test_invitations_let_in_whom_they_name_once(served: Served) -> None:
    http = served.client()
    for path in ("/s/invited", "/s/invited?code=wrong-1"):
        assert http.get(path).status_code == 403
    assert http.post("/s/invited/begin?code=wrong-1").status_code == 403
    first = Participant(served, "invited", "?code=abc-123")
    assert first.stage == "consent"
    assert Participant(served, "invited", "?code=abc-123").path == first.path
    assert Participant(served, "invited", "?code=abc-124").path != first.path


def test_d17_a_quiz_has_its_tries_and_a_form_sent_again_is_no_new_one(served: Served) -> None:
    person = at_the_quiz(served, "q", "timed")
    assert "3 tries" in person.page.text
    for _ in range(3):
        person.submit({"onions": "2"}, step="quiz")
        assert "2 more tries" in person.page.text
        assert "Count them." in person.page.text
    assert row_of(person).tries == 1
    person.submit({"onions": "4"})
    person.load()
    assert "1 more try" in person.page.text
    person.submit({"onions": "2"})
    assert person.stage == "ending"
    assert "FAIL-1" in person.page.text
    row = row_of(person)
    assert (row.status, row.completion_code) == ("failed_checks", "FAIL-1")
    person = at_the_quiz(served, "r", "timed")
    person.submit({"onions": "2"})
    person.submit({"onions": "3"})
    assert person.stage == "break"


def test_screened_out_people_get_their_own_code_and_way_back(served: Served) -> None:
    person = Participant(served, "timed", "?PROLIFIC_PID=a%26b")
    person.agree()
    person.submit({"age": "young", "extra": "no"})
    assert person.stage == "ending"
    assert "OUT-1" in person.page.text
    assert row_of(person).status == "screened_out"


def test_conditions_skips_waits_and_limits(served: Served) -> None:
    person = Participant(served, "timed")
    person.agree()
    person.submit({"age": "old", "extra": "yes"})
    person.submit({"skip": "1"})
    assert person.stage == "quiz", "a quiz may not be skipped"
    person.submit({"onions": "3"})
    assert person.step == "extra"
    assert 'name="skip"' in person.page.text
    person.submit({"skip": "1"})
    assert person.step == "rest"
    early = person.submit()
    assert (early.status_code, person.step) == (422, "rest")
    assert "a little more time" in early.text
    earlier(served, person.token, 2)
    person.submit()
    assert person.step == "quick"
    assert 'data-left="2"' in person.page.text
    late = person.submit({"time_up": "1"})
    assert (late.status_code, person.step) == (200, "strict"), (
        "what is missing when the time is up is left out"
    )
    answers = stored_answers(served.store, row_of(person).id)
    assert set(answers) == {"gate", "quiz"}
    earlier(served, person.token, 30)
    person.submit(OLD)
    assert person.stage == "debrief"
    assert row_of(person).completion_code == "DONE-1"


def test_time_that_is_up_is_seen_by_the_server_alone(served: Served) -> None:
    person = at_the_quiz(served, "t", "timed")
    person.submit({"onions": "3"})
    earlier(served, person.token, 3)
    person.submit()
    assert person.step == "quick"
    earlier(served, person.token, 10)
    person.submit(OLD)
    assert person.step == "strict"
    assert "quick" not in stored_answers(served.store, row_of(person).id), "it came much too late"
    earlier(served, person.token, 90)
    person.load()
    assert person.stage == "ending"
    assert row_of(person).status == "timed_out"


def test_the_redirect_carries_code_and_parameters(served: Served, tmp_path: Path) -> None:
    ends = "stages:\n  - {kind: consent, text: consent}\n  - {kind: debrief, text: debrief}\n"
    short = FLOW.partition("stages:")[0].replace("quota: 2\n", "") + ends
    workspace = study_workspace(tmp_path / "lab", short)
    with serving(workspace, tmp_path / "records.sqlite", preview=True) as up:
        person = Participant(up, query="?PROLIFIC_PID=a%26b")
        assert "Test visit" in person.page.text
        person.agree()
        assert person.stage == "debrief"
        assert "https://example.org/back?cc=DONE-1&amp;pid=a%26b" in person.page.text
        row = row_of(person)
        assert (row.test, row.slot, row.status) == (True, None, "completed")
        assert Participant(up, query="?PROLIFIC_PID=a%26b").path != person.path, "tests may be repeated"
