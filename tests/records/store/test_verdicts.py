"""Whether an answer is right is said once, by the item: records, flags and pages repeat it."""

from __future__ import annotations

from dataclasses import replace

from sqlalchemy import update

from galley.records import Store
from galley.records.database.tables import ATTEMPTS, RESPONSES, VISITS
from galley.records.reading.flags import flags
from galley.study.scores import wrong_items
from galley.study.stages.stage_kinds import QuizStep
from galley.study.written.questionnaire import failed_checks, validate_answers
from tests.records.helpers import START_MS, begin, plan
from tests.study.written.test_questionnaire import made

THREE = [{"value": value, "label": value.upper()} for value in ("a", "b", "c")]
CHECKS = made(
    {"kind": "multiple_choice", "options": THREE, "expected": ["c", "a"]},
    {"kind": "number", "min": 0, "max": 9, "expected": 3},
    {"kind": "short_text"},
)


def test_expected_choices_in_another_order_than_the_options_are_right_everywhere(store: Store) -> None:
    visit = begin(store)
    answers, problems = validate_answers(CHECKS, {"q0": ["c", "a"], "q1": ["3"], "q2": ["fine"]})
    assert (problems, answers["q0"]) == ({}, ["a", "c"])
    assert failed_checks(CHECKS, answers) == ()
    assert store.save_answers(
        visit.id, "survey", answers, 1, "active", START_MS, questionnaire=CHECKS
    ).result()
    with store.reading() as connection:
        rows = connection.execute(RESPONSES.select().order_by(RESPONSES.c.position)).all()
        assert [row.passed for row in rows] == [True, True, None]
        assert flags(connection, visit.study) == {}


def test_a_quiz_that_goes_on_after_its_last_try_raises_no_flag_of_attention_checks(store: Store) -> None:
    visit = begin(store)
    quiz = QuizStep(
        id="consent",
        title="Quiz",
        questionnaire="quiz",
        expected=CHECKS.expected,
        tries=1,
        after_last="go_on",
    )
    whole = replace(plan(), steps=(quiz, *plan().steps[1:]))
    store.write(
        lambda connection: connection.execute(update(VISITS).values(plan_json=whole.to_json()))
    ).result()
    wrong = {"q0": ["b"], "q1": 4, "q2": "fine"}
    store.save_answers(visit.id, "consent", wrong, 1, "active", START_MS, questionnaire=CHECKS).result()
    with store.reading() as connection:
        assert flags(connection, visit.study) == {}
    store.save_answers(visit.id, "comparison", wrong, 2, "active", START_MS, questionnaire=CHECKS).result()
    with store.reading() as connection:
        (flag,) = flags(connection, visit.study)[visit.id]
    assert (flag.kind, flag.value) == ("failed_checks", 2.0)


def test_an_attempt_counts_the_same_items_as_wrong_as_its_page_marks(store: Store) -> None:
    visit = begin(store)
    answers = {"q0": ["a", "c"], "q1": 4, "q2": "fine"}
    store.save_attempt(visit.id, "quiz", 1, answers, START_MS, CHECKS).result()
    with store.reading() as connection:
        (stored,) = connection.execute(ATTEMPTS.select()).all()
    assert stored.wrong == list(wrong_items(CHECKS, answers)) == ["q1"]
