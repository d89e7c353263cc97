"""What researchers see of studies while they run."""

from __future__ import annotations

import pytest

from galley.errors import GalleyError
from galley.records import ClockRow, PauseRow, Store, TickRow, VisitRow
from galley.records.reading import overview
from galley.study.written.questionnaire import Questionnaire
from tests.records.helpers import START_MS, begin, joint_actions, one_soup, open_round, play, tick_rows
from tests.records.store.test_slots import arrive, begun, leave
from tests.records.stored import stored_answers, stored_visit

CHECK = {
    "id": "check",
    "kind": "likert",
    "text": "Choose 2.",
    "scale": 7,
    "low_label": "no",
    "high_label": "yes",
    "expected": 2,
}
CHECKS = Questionnaire.model_validate({"format": 1, "title": "T", "source": "S", "items": (CHECK,)})
LATER = START_MS + 20_000


def asked(store: Store, visit: VisitRow, value: int) -> None:
    answers = {"check": value}
    assert store.save_answers(
        visit.id, "rounds-1-questions", answers, 4, "active", LATER, questionnaire=CHECKS
    ).result()


def test_studies_are_counted_without_tests(store: Store) -> None:
    first, second = begun(arrive(store)), begun(arrive(store))
    begun(arrive(store, test=True))
    leave(store, second, "completed")
    open_round(store, first)
    store.set_study_state("demo", "paused", START_MS).result()
    (study,) = store.read(overview.studies).result()
    expected = overview.StudyOverview("demo", "paused", 3, {"active": 1, "completed": 1}, 1, 1)
    assert study == expected


def test_stages_tell_who_is_where_and_who_left(store: Store) -> None:
    for number, fate in enumerate(("declined", "active", "completed", "screened_out", "silent")):
        visit = begin(store)
        store.enter_step(visit.id, "consent", START_MS).result()
        if fate == "silent":
            continue
        status = fate if fate == "declined" else "active"
        store.save_answers(visit.id, "consent", {}, 1, status, START_MS + 1000 * (number + 1)).result()
        if fate == "declined":
            continue
        store.enter_step(visit.id, "rounds-1-questions", START_MS + 9000).result()
        if fate != "active":
            store.save_answers(visit.id, "rounds-1-questions", {"a": 1}, 4, fate, LATER).result()
    tried = begun(arrive(store, test=True))
    store.enter_step(tried.id, "consent", START_MS).result()
    consent, questions = store.read(lambda c: overview.stages(c, "demo")).result()
    assert consent == overview.StageCount("consent", "Consent", "consent", 5, 3, 1, 1, 2.5)
    assert questions == overview.StageCount("rounds-1-questions", "After", "questionnaire", 3, 1, 1, 1, 11.0)


def test_cells_count_completed_held_and_free_slots(store: Store) -> None:
    visits = [begun(arrive(store)) for _ in range(4)]
    leave(store, visits[0], "completed")
    leave(store, visits[1], "declined")
    found = store.read(lambda c: overview.cells(c, "demo")).result()
    assert found == (
        overview.CellCount({"arm": "a"}, 1, 1, 0),
        overview.CellCount({"arm": "b"}, 0, 0, 1),
        overview.CellCount({"arm": "c"}, 1, 0, 0),
    )


def test_visits_are_flagged_for_what_stands_out(store: Store) -> None:
    good, bad = begin(store), begin(store)
    for visit, late in ((good, False), (bad, True)):
        round_id = open_round(store, visit)
        rows = tick_rows(one_soup()[:38])
        store.journal(round_id, rows, clocks=[ClockRow(1.0, LATER, 900.0 if late else 40.0, 1)])
        store.journal(round_id, [TickRow(38, 4, 4, START_MS, 1.0, None, late)])
        store.finish_round(round_id, "abandoned", 0, 0, LATER, b"").result()
        asked(store, visit, 5 if late else 2)
        store.hidden(visit.id, "consent", START_MS, START_MS + 5000).result()
    store.hidden(bad.id, "consent", START_MS + 9000).result()
    store.hidden(bad.id, "consent", START_MS + 9000, START_MS + 79_000).result()
    found = store.read(lambda c: overview.flags(c, "demo")).result()
    assert list(found) == [bad.id]
    assert [(flag.kind, round(flag.value, 3)) for flag in found[bad.id]] == [
        ("late_agent", 0.026),
        ("hidden_tab", 75.0),
        ("failed_checks", 1.0),
        ("slow_client", 900.0),
    ]
    newest, oldest = store.read(lambda c: overview.visits(c, "demo")).result()
    assert (newest.id, newest.flags, oldest.flags) == (bad.id, found[bad.id], ())
    assert [v.id for v in store.read(lambda c: overview.visits(c, "demo", flagged=True)).result()] == [bad.id]
    assert [v.id for v in store.read(lambda c: overview.visits(c, "demo", flagged=False)).result()] == [
        good.id
    ]
    alone = store.read(lambda c: overview.visit(c, bad.id)).result()
    assert alone == newest


def test_visits_are_listed_newest_first_by_the_page(store: Store) -> None:
    visits = [begun(arrive(store)) for _ in range(5)]
    tried = begun(arrive(store, test=True))
    leave(store, visits[3], "completed")
    store.add_note(visits[3].id, "ada", "odd", START_MS).result()

    def listed(**how: object) -> list[int]:
        return [visit.id for visit in store.read(lambda c: overview.visits(c, "demo", **how)).result()]  # type: ignore[arg-type]

    ids = [visit.id for visit in visits]
    assert listed() == ids[::-1]
    assert listed(limit=2, offset=1) == [ids[3], ids[2]]
    assert listed(status="completed") == [ids[3]]
    assert listed(tests=True)[0] == tried.id
    done = store.read(lambda c: overview.visit(c, ids[3])).result()
    assert done is not None
    assert (done.step_id, done.notes, done.slot, done.status) == ("tutorial", 1, 3, "completed")
    assert store.read(lambda c: overview.visit(c, 10_000)).result() is None


def test_rounds_are_listed_with_who_sat_there(store: Store) -> None:
    visit = begin(store)
    first = open_round(store, visit)
    play(store, first, one_soup())
    second = open_round(store, visit, "rounds-2")
    store.journal(second, tick_rows(joint_actions(1, 9)))
    store.flush().result()
    newest, oldest = store.read(lambda c: overview.rounds(c, "demo")).result()
    assert (newest.id, newest.status, newest.ticks, newest.ticks_whole, newest.score) == (
        second,
        "open",
        9,
        40,
        None,
    )
    assert (oldest.id, oldest.status, oldest.ticks, oldest.score) == (first, "finished", 40, 20)
    assert (oldest.participants, oldest.agents, oldest.visit_ids) == (
        (visit.participant,),
        ("chef-a",),
        (visit.id,),
    )
    assert store.read(lambda c: overview.current_rounds(c, "demo")).result() == (newest,)
    other = begin(store)
    assert store.read(lambda c: overview.rounds(c, "demo", visit_id=other.id)).result() == ()


def test_the_timeline_tells_what_happened_in_order(store: Store) -> None:
    visit = begin(store)
    store.enter_step(visit.id, "consent", START_MS).result()
    store.save_answers(visit.id, "consent", {}, 1, "active", START_MS + 900, consent_sha256="c" * 64).result()
    assert store.save_attempt(visit.id, "quiz", 1, {"check": 3}, START_MS + 1500, CHECKS).result() is True
    assert store.save_attempt(visit.id, "quiz", 1, {"check": 3}, START_MS + 1500, CHECKS).result() is False
    round_id = open_round(store, visit)
    store.journal(round_id, pauses=[PauseRow(3, START_MS + 2000.0, START_MS + 3500.0, "left")])
    store.finish_round(round_id, "abandoned", 0, 0, START_MS + 4000, b"").result()
    store.hidden(visit.id, "consent", START_MS + 500, START_MS + 600).result()
    store.add_note(visit.id, "ada", "rang up", START_MS + 5000).result()
    assert store.end_visit(visit.id, "timed_out", START_MS + 6000, "SORRY").result() is True
    assert store.end_visit(visit.id, "completed", START_MS + 7000).result() is False
    found = store.read(lambda c: overview.timeline(c, visit.id)).result()
    assert [(entry.kind, entry.at_ms - START_MS) for entry in found] == [
        ("began", 0),
        ("entered", 0),
        ("round", 0),
        ("hidden", 500),
        ("left", 900),
        ("attempt", 1500),
        ("paused", 2000),
        ("round_over", 4000),
        ("note", 5000),
        ("ended", 6000),
    ]
    assert "attempt 1 failed: check" in [entry.words for entry in found]
    after = stored_visit(store, visit.token)
    assert after is not None
    assert (after.status, after.completion_code, after.tries) == ("timed_out", "SORRY", 1)
    assert after.consent_sha256 == "c" * 64


def test_answers_come_back_by_step_and_for_the_page(store: Store) -> None:
    visit = begin(store)
    store.save_answers(visit.id, "survey", {"b": 1, "a": ["x"]}, 1, "active", START_MS).result()
    asked(store, visit, 3)
    found = stored_answers(store, visit.id)
    assert found == {"survey": {"b": 1, "a": ["x"]}, "rounds-1-questions": {"check": 3}}
    rows = store.read(lambda c: overview.answers(c, visit.id)).result()
    assert [(row.item, row.text, row.value, row.passed) for row in rows] == [
        ("b", "b", 1, None),
        ("a", "a", ["x"], None),
        ("check", "Choose 2.", 3, False),
    ]


def test_a_note_belongs_to_a_visit(store: Store) -> None:
    visit = begin(store)
    number = store.add_note(visit.id, "ada", "<b>bold</b>", START_MS).result()
    (note,) = store.read(lambda c: overview.notes(c, visit.id)).result()
    assert note == overview.NoteRow(number, "ada", "<b>bold</b>", START_MS)
    with pytest.raises(GalleyError, match="no visit 99"):
        store.add_note(99, "ada", "x", START_MS).result()
