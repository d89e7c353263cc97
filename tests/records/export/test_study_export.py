"""Exports of real stores, read back as an analyst would."""

from __future__ import annotations

import csv
import tracemalloc
from pathlib import Path
from typing import Any

import pytest

from galley.errors import GalleyError
from galley.kitchen import ACTIONS
from galley.kitchen.trajectory import replay
from galley.records import PauseRow, Store, TickRow, VisitRow
from galley.records.export.columns import SHEETS, WIDE
from galley.records.export.study_export import export_study
from galley.study.written.questionnaire import Questionnaire
from tests.records.helpers import START_MS, begin, joint_actions, one_soup, open_round, play, tick_rows
from tests.records.stored import stored_trajectory

SCALE = {"scale": 7, "low_label": "low", "high_label": "high"}
AFTER = (
    {"id": "fluent", "kind": "likert", "text": "We worked fluently.", **SCALE},
    {
        "id": "which",
        "kind": "multiple_choice",
        "text": "What went well?",
        "options": ({"value": "pots", "label": "The pots"}, {"value": "dishes", "label": "The dishes"}),
    },
    {"id": "why", "kind": "long_text", "text": "Why?", "required": False},
    {"id": "age", "kind": "number", "text": "Your age?", "min": 18, "max": 99},
)
COMPARE = (
    {"id": "prefer", "kind": "comparison", "text": "Whom did you prefer?", **SCALE},
    {"id": "trust", "kind": "comparison", "text": "Whom did you trust?", **SCALE},
)


def answer(
    store: Store, visit: VisitRow, step: str, items: tuple[Any, ...], answers: dict[str, Any], at: int
) -> None:
    asked = Questionnaire.model_validate({"format": 1, "title": "T", "source": "S", "items": items})
    store.enter_step(visit.id, step, START_MS + at - 2500).result()
    saved = store.save_answers(visit.id, step, answers, 4, "active", START_MS + at, questionnaire=asked)
    assert saved.result()


def whole_visit(store: Store) -> VisitRow:
    """A visit through every step of the plan, with one soup served in round 1."""
    visit = begin(store, PROLIFIC_PID="=HYPERLINK()")
    store.enter_step(visit.id, "consent", START_MS).result()
    store.save_answers(visit.id, "consent", {}, 1, "active", START_MS + 4000).result()
    play(store, open_round(store, visit, "tutorial"), joint_actions(5, 40), "skipped")
    play(store, open_round(store, visit, "rounds-1"), one_soup())
    after = {
        "fluent": 6,
        "which": ["pots", "dishes"],
        "why": "=cmd|' /C calc'!A0, \"really\"\nyes",
        "age": None,
    }
    answer(store, visit, "rounds-1-questions", AFTER, after, 20_000)
    play(store, open_round(store, visit, "rounds-2"), joint_actions(6, 11), "abandoned")
    answer(store, visit, "comparison", COMPARE, {"prefer": 2, "trust": 4}, 30_000)
    store.save_answers(
        visit.id, "debrief", {}, 6, "completed", START_MS + 40_000, completion_code="DONE"
    ).result()
    return visit


def exported(store: Store, out: Path) -> dict[str, list[dict[str, str]]]:
    """The rows of every file, by the sheet's name."""
    counts = export_study(store, "demo", out)
    found = {}
    for sheet in SHEETS:
        with (out / sheet.file).open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file, strict=True)
            names = [field.name for field in sheet.fields]
            assert reader.fieldnames is not None
            assert reader.fieldnames[: len(names)] == names
            assert sheet is WIDE or len(reader.fieldnames) == len(names)
            found[sheet.name] = list(reader)
            assert counts[sheet.file] == len(found[sheet.name])
    return found


def some(row: dict[str, str], **expected: str) -> bool:
    assert {name: row[name] for name in expected} == expected
    return True


SUBSCALES = (
    {"id": "load", "kind": "slider", "text": "Hard?", "step": 5, "low_label": "l", "high_label": "h"},
    {"id": "ease", "kind": "slider", "text": "Easy?", "step": 5, "low_label": "l", "high_label": "h"},
    {"id": "sure", "kind": "likert", "text": "Sure?", "required": False, "subscale": "trust", **SCALE},
    {"id": "open", "kind": "short_text", "text": "Else?", "subscale": "trust", "required": False},
)
WORKLOAD = (
    {**SUBSCALES[0], "subscale": "workload"},
    {**SUBSCALES[1], "subscale": "workload", "reversed": True},
)


def test_subscales(store: Store, tmp_path: Path) -> None:
    visit = begin(store)
    play(store, open_round(store, visit, "rounds-1"), one_soup())
    answers = {"load": 80, "ease": 25, "sure": None, "open": None}
    answer(store, visit, "rounds-1-questions", (*WORKLOAD, *SUBSCALES[2:]), answers, 20_000)
    whole_visit(store)
    found = exported(store, tmp_path / "out")
    assert [(row["item"], row["subscale"], row["subscale_value"]) for row in found["responses"]][:4] == [
        ("load", "workload", "80"),
        ("ease", "workload", "75"),
        ("sure", "trust", ""),
        ("open", "", ""),
    ]
    workload, trust = found["subscales"]
    about = {"step": "rounds-1-questions", "questionnaire": "after", "round_no": "1", "agent": "chef-a"}
    assert some(workload, **about, subscale="workload", items="2", answered="2", mean="77.5")
    assert some(trust, **about, subscale="trust", items="1", answered="0", mean="")
    first, second = found["wide"]
    names = [f"rounds-1-questions.subscale.{name}" for name in ("trust", "workload")]
    assert list(first)[-2:] == names, "at the end: all other columns stay where they were"
    assert [first[name] for name in names] == ["", "77.5"]
    assert [second[name] for name in names] == ["", ""]


def test_participants(store: Store, tmp_path: Path) -> None:
    visit, other = whole_visit(store), begin(store)
    first, second = exported(store, tmp_path / "out")["participants"]
    assert some(
        first,
        participant=visit.participant,
        visit_no="0",
        study="demo",
        condition='{"arm": "a"}',
        seed=str(2**64 - 1),
        status="completed",
        step="debrief",
        steps="7",
        completion_code="DONE",
        hats='{"chef-a": "orange", "chef-b": "yellow"}',
        link_params='{"PROLIFIC_PID": "=HYPERLINK()"}',
        begun_utc="2025-10-09T08:53:20.000Z",
        ended_utc="2025-10-09T08:54:00.000Z",
        duration_s="40",
        rounds_finished="1",
        rounds_abandoned="1",
    )
    assert some(
        second, participant=other.participant, status="active", ended_utc="", duration_s="", step="consent"
    )


def test_the_secret_of_a_link_is_in_no_file(store: Store, tmp_path: Path) -> None:
    visit = whole_visit(store)
    export_study(store, "demo", tmp_path / "out")
    for file in (tmp_path / "out").iterdir():
        assert visit.token not in file.read_text(encoding="utf-8")


def test_stages(store: Store, tmp_path: Path) -> None:
    whole_visit(store)
    rows = exported(store, tmp_path / "out")["stages"]
    assert [row["step"] for row in rows] == ["consent", "rounds-1-questions", "comparison", "debrief"]
    assert some(rows[0], kind="consent", title="Consent", duration_s="4", views="1", step_index="0")
    assert some(rows[1], kind="questionnaire", duration_s="2.5", left_utc="2025-10-09T08:53:40.000Z")


def test_rounds_with_their_measures(store: Store, tmp_path: Path) -> None:
    visit = whole_visit(store)
    tutorial, first, second = exported(store, tmp_path / "out")["rounds"]
    assert some(tutorial, tutorial="true", round_no="0", status="skipped", goal="", goal_reached="")
    assert some(
        first,
        participant=visit.participant,
        round_no="1",
        step="rounds-1",
        tutorial="false",
        layout="tiny",
        agent="chef-a",
        agent_sha256="a" * 64,
        human_seat="1",
        human_hat="blue",
        partner_hat="orange",
        seed=str(2**63 + 5),
        status="finished",
        ticks="40",
        horizon_ticks="40",
        score="20",
        deliveries="1",
        goal="20",
        goal_reached="true",
        started_utc="2025-10-09T08:53:20.000Z",
        pauses="1",
        paused_s="0.5",
        late_ticks="0",
        lateness_median_ms="0.5",
        decision_p99_ms="3.25",
        rtt_median_ms="",
        replays="true",
    )
    # Seat 0, the partner, did everything; the participant stood still.
    assert some(first, human_ingredients="0", human_dishes="0", human_served="0", concurrent_ticks="0")
    assert some(first, partner_ingredients="3", partner_dishes="1", partner_served="1", delivery_ticks="[40]")
    assert some(second, status="abandoned", ticks="11", agent="chef-b", human_seat="0", goal_reached="false")


def test_ticks(store: Store, tmp_path: Path) -> None:
    whole_visit(store)
    rows = exported(store, tmp_path / "out")["ticks"]
    assert [int(row["tick"]) for row in rows] == [*range(40), *range(40), *range(11)]
    soup = rows[40:80]
    assert [row["action_0"] for row in soup] == [ACTIONS[action] for action, _ in one_soup()]
    assert all(
        some(row, human_action="stay", action_1="stay", partner_action=row["action_0"]) for row in soup
    )
    assert [row["score"] for row in soup] == ["0"] * 39 + ["20"]
    assert [row["reward"] for row in soup] == ["0"] * 39 + ["20"]
    assert some(
        soup[3],
        deadline_utc="2025-10-09T08:53:20.150Z",
        lateness_ms="0.5",
        decision_ms="3.25",
        late="false",
        fault="",
    )


def test_events(store: Store, tmp_path: Path) -> None:
    whole_visit(store)
    rows = [row for row in exported(store, tmp_path / "out")["events"] if row["round_no"] == "1"]
    told = [(row["kind"], row["thing"], row["by"]) for row in rows if row["kind"] != "blocked"]
    onion = [("pick_up", "onion", "partner"), ("potting", "onion", "partner")]
    assert told == [
        *onion * 3,
        ("pick_up", "dish", "partner"),
        ("soup_ready", "onion_soup", ""),
        ("pick_up", "onion_soup", "partner"),
        ("delivery", "onion_soup", "partner"),
    ]
    assert some(rows[-1], tick="39", seat="0", place="serving", x="3", y="3", reward="20")


def test_responses(store: Store, tmp_path: Path) -> None:
    whole_visit(store)
    fluent, which, why, age, prefer, trust = exported(store, tmp_path / "out")["responses"]
    about = {"round_no": "1", "layout": "tiny", "agent": "chef-a", "partner_hat": "orange", "first_agent": ""}
    assert some(
        fluent, questionnaire="after", position="1", item="fluent", kind="likert", value="6", scale="7"
    )
    assert some(
        fluent, text="We worked fluently.", low_label="low", high_label="high", preference="", **about
    )
    assert some(which, value="pots | dishes", label="The pots | The dishes", **about)
    assert some(why, value="'=cmd|' /C calc'!A0, \"really\"\nyes", label="")
    assert some(age, value="", label="", kind="number")
    sides = {
        "first_agent": "chef-a",
        "first_hat": "orange",
        "second_agent": "chef-b",
        "second_hat": "yellow",
        "round_no": "",
        "agent": "",
    }
    assert some(prefer, kind="comparison", value="2", preference="-2", preferred_agent="chef-a", **sides)
    assert some(trust, value="4", preference="0", preferred_agent="", **sides)


def test_keys_pauses_and_clocks(store: Store, tmp_path: Path) -> None:
    whole_visit(store)
    found = exported(store, tmp_path / "out")
    key = next(row for row in found["keys"] if row["round_no"] == "1")
    assert some(
        key, key="up", down="true", client_ms="10.5", arrival_utc="2025-10-09T08:53:20.007Z", tick_applied="0"
    )
    pause = next(row for row in found["pauses"] if row["round_no"] == "1")
    assert some(pause, tick="3", reason="left", started_utc="2025-10-09T08:53:20.150Z")
    ping = next(row for row in found["clocks"] if row["round_no"] == "1")
    assert some(ping, client_ms="11", server_utc="2025-10-09T08:53:20.008Z", rtt_ms="")


def test_two_exports_are_equal_byte_for_byte(store: Store, tmp_path: Path) -> None:
    for _ in range(2):
        whole_visit(store)
    export_study(store, "demo", tmp_path / "a")
    export_study(store, "demo", tmp_path / "b")
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == sorted(["data-dictionary.csv", "data-dictionary.md", *(sheet.file for sheet in SHEETS)])
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_a_round_that_does_not_replay_is_exported_without_measures(store: Store, tmp_path: Path) -> None:
    round_id = open_round(store, begin(store))
    store.journal(round_id, tick_rows(one_soup()))
    store.finish_round(round_id, "finished", 60, 3, START_MS, b"other").result()
    found = exported(store, tmp_path / "out")
    assert some(found["rounds"][0], replays="false", score="60", partner_ingredients="", concurrent_ticks="")
    assert len(found["ticks"]) == 40
    assert some(found["ticks"][0], action_0="north", reward="", score="")
    assert found["events"] == []


def test_an_open_round_and_a_late_agent_show(store: Store, tmp_path: Path) -> None:
    round_id = open_round(store, begin(store))
    late = TickRow(0, 4, 2, START_MS + 0.25, 12.5, None, True)
    fault = TickRow(1, 4, 2, START_MS + 50.0, 1.5, 2.0, False, "error")
    store.journal(round_id, [late, fault], pauses=[PauseRow(2, START_MS + 60.0, None, "left")])
    store.flush().result()
    found = exported(store, tmp_path / "out")
    assert some(
        found["rounds"][0],
        status="open",
        ticks="2",
        score="",
        late_ticks="1",
        fault_ticks="1",
        replays="true",
    )
    assert some(
        found["rounds"][0], lateness_max_ms="12.5", pauses="1", paused_s="0", goal="20", goal_reached=""
    )
    assert some(found["ticks"][0], decision_ms="", late="true")
    assert some(found["ticks"][1], fault="error", late="false")
    assert some(found["pauses"][0], ended_utc="")


def test_an_unknown_study_names_those_there_are(store: Store, tmp_path: Path) -> None:
    with pytest.raises(GalleyError, match="no visit of study 'demo'; nobody has visited any study"):
        export_study(store, "demo", tmp_path / "out")
    begin(store, "other")
    with pytest.raises(GalleyError, match="'demo'; it has other"):
        export_study(store, "demo", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_told(store: Store, tmp_path: Path) -> None:
    begin(store)
    (tmp_path / "out").write_text("a file")
    with pytest.raises(GalleyError, match="--out"):
        export_study(store, "demo", tmp_path / "out")


def test_memory_does_not_grow_with_the_study(store: Store, tmp_path: Path) -> None:
    def peak(visits: int) -> int:
        for _ in range(visits):
            visit = begin(store)
            play(store, open_round(store, visit), joint_actions(1, 40))
        export_study(store, "demo", tmp_path / "out")
        tracemalloc.start()
        export_study(store, "demo", tmp_path / "out")
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    few, many = peak(4), peak(56)
    assert many < 1.3 * few


def test_the_trajectory_of_a_stored_round_replays(store: Store) -> None:
    round_id = open_round(store, begin(store))
    kitchen = play(store, round_id, one_soup())
    trajectory = stored_trajectory(store, round_id)
    assert replay(trajectory)[-1].tolist() == kitchen.state.tolist()
    assert (trajectory.seats[0].name, trajectory.seats[1].kind) == ("chef-a", "human")
    assert trajectory.seed == 2**63 + 5
    with pytest.raises(GalleyError, match="no round 77"):
        stored_trajectory(store, 77)
