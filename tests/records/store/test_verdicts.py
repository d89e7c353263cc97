"""Whether an answer is right is said once, by the item: records, flags and pages repeat it."""

from __future__ import annotations

from galley.records import Store
from galley.records.database.tables import ATTEMPTS, RESPONSES
from galley.records.reading.flags import flags
from galley.study.scores import wrong_items
from galley.study.written.questionnaire import failed_checks, validate_answers
from tests.records.helpers import START_MS, begin
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


def test_an_attempt_counts_the_same_items_as_wrong_as_its_page_marks(store: Store) -> None:
    visit = begin(store)
    answers = {"q0": ["a", "c"], "q1": 4, "q2": "fine"}
    store.save_attempt(visit.id, "quiz", 1, answers, START_MS, CHECKS).result()
    with store.reading() as connection:
        (stored,) = connection.execute(ATTEMPTS.select()).all()
    assert stored.wrong == list(wrong_items(CHECKS, answers)) == ["q1"]
