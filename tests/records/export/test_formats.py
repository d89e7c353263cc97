"""The other exports: JSON Lines, Parquet, the wide sheet, trajectories, the field's public schema."""

from __future__ import annotations

import csv
import json
import zipfile
from pathlib import Path

import pyarrow.parquet
import pytest

from galley.errors import GalleyError
from galley.kitchen.trajectory import from_text
from galley.records import Store
from galley.records.export.columns import SHEETS
from galley.records.export.human_data import HUMAN_DATA
from galley.records.export.study_export import export_study
from galley.records.export.trajectory_export import export_human_data, export_trajectories
from galley.study.stages.round_step import RoundStep
from galley.study.visit.plan import Plan
from tests.overcooked_package import mdp
from tests.records.export.test_study_export import whole_visit
from tests.records.helpers import START_MS, begin, joint_actions, one_soup, open_round, play
from tests.records.store.test_rounds import finish, shared
from tests.records.store.test_slots import arrive, begun


def read_csv(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8", newline="") as text:
        return list(csv.DictReader(text, strict=True))


def test_every_format_holds_the_same_rows(store: Store, tmp_path: Path) -> None:
    whole_visit(store)
    counts = export_study(store, "demo", tmp_path, formats=("csv", "jsonl", "parquet"))
    for sheet in SHEETS:
        rows = read_csv(tmp_path / f"{sheet.name}.csv")
        lines = (tmp_path / f"{sheet.name}.jsonl").read_text(encoding="utf-8").splitlines()
        objects = [json.loads(line) for line in lines]
        table = pyarrow.parquet.read_table(tmp_path / f"{sheet.name}.parquet")
        assert counts[f"{sheet.name}.csv"] == len(rows) == len(objects) == table.num_rows
        for row, one in zip(rows, objects, strict=True):
            assert list(one) == list(row) == table.column_names
    participant = json.loads((tmp_path / "participants.jsonl").read_text(encoding="utf-8"))
    assert participant["condition"] == {"arm": "a"}
    assert participant["link_params"] == {"PROLIFIC_PID": "=HYPERLINK()"}
    assert (participant["duration_s"], participant["test"]) == (40.0, False)
    (begun_at,) = pyarrow.parquet.read_table(tmp_path / "participants.parquet")["begun_utc"].to_pylist()
    assert begun_at.timestamp() * 1000 == START_MS
    ticks = pyarrow.parquet.read_table(tmp_path / "ticks.parquet")
    assert ticks["score"].to_pylist()[79] == 20


def test_an_unknown_format_is_refused(store: Store, tmp_path: Path) -> None:
    whole_visit(store)
    with pytest.raises(GalleyError, match="xlsx is unknown; use csv, jsonl, parquet"):
        export_study(store, "demo", tmp_path, formats=("csv", "xlsx"))


def test_the_wide_sheet_has_one_row_a_visit(store: Store, tmp_path: Path) -> None:
    visit, other = whole_visit(store), begin(store)
    export_study(store, "demo", tmp_path)
    first, second = read_csv(tmp_path / "wide.csv")
    assert (first["participant"], second["participant"]) == (visit.participant, other.participant)
    assert first["rounds-1-questions.fluent"] == "6"
    assert first["rounds-1-questions.which"] == "pots | dishes"
    assert (first["rounds-1.score"], first["rounds-1.agent"], first["rounds-2.status"]) == (
        "20",
        "chef-a",
        "abandoned",
    )
    assert first["comparison.prefer"] == "2"
    assert second["comparison.prefer"] == second["rounds-1.score"] == ""


def test_factors_are_columns_of_the_wide_sheet(store: Store, tmp_path: Path) -> None:
    for _ in range(3):
        begun(arrive(store))
    export_study(store, "demo", tmp_path)
    assert [row["condition.arm"] for row in read_csv(tmp_path / "wide.csv")] == ["a", "b", "c"]


def test_tests_are_left_out_unless_asked_for(store: Store, tmp_path: Path) -> None:
    tried = begun(arrive(store, test=True))
    play(store, open_round(store, tried), one_soup())
    real = begun(arrive(store))
    export_study(store, "demo", tmp_path / "a")
    assert [row["participant"] for row in read_csv(tmp_path / "a" / "participants.csv")] == [real.participant]
    assert read_csv(tmp_path / "a" / "rounds.csv") == []
    assert export_trajectories(store, "demo", tmp_path / "a.zip") == 0
    export_study(store, "demo", tmp_path / "b", include_test=True)
    rows = read_csv(tmp_path / "b" / "participants.csv")
    assert [(row["participant"], row["test"]) for row in rows] == [
        (tried.participant, "true"),
        (real.participant, "false"),
    ]
    assert export_trajectories(store, "demo", tmp_path / "b.zip", include_test=True) == 1


def test_d6_d7_a_round_for_two_is_told_by_each_with_the_hats_that_they_saw(
    store: Store, tmp_path: Path
) -> None:
    ada, bob = begin(store), begin(store)
    round_id = store.set_up_round(shared(ada, bob)).result()
    finish(store, round_id, [one_soup()], "finished")
    export_study(store, "demo", tmp_path)
    rows = read_csv(tmp_path / "rounds.csv")
    assert [(row["participant"], row["partner_participant"], row["agent"]) for row in rows] == [
        (ada.participant, bob.participant, ""),
        (bob.participant, ada.participant, ""),
    ]
    assert {row["round_id"] for row in rows} == {str(round_id)}
    assert {row["dyad"] for row in rows} == {f"{ada.visit_no}+{bob.visit_no}"}
    assert [row["human_seat"] for row in rows] == ["0", "1"]
    for row, visit in zip(rows, (ada, bob), strict=True):
        (step,) = (step for step in Plan.from_json(visit.plan_json).steps if step.id == row["step"])
        assert isinstance(step, RoundStep)
        assert row["partner_hat"] == step.partner_hat
    sides = [(row["replays"], row["human_served"], row["partner_served"]) for row in rows]
    assert sides == [("true", "1", "0"), ("true", "0", "1")]
    for kind in ("jsonl", "parquet"):
        export_study(store, "demo", tmp_path / kind, (kind,))
    lines = [json.loads(line) for line in (tmp_path / "jsonl" / "rounds.jsonl").read_text().splitlines()]
    assert [line["dyad"] for line in lines] == [row["dyad"] for row in rows]
    assert [line["human_served"] for line in lines] == [1, 0]
    table = pyarrow.parquet.read_table(tmp_path / "parquet" / "rounds.parquet")
    assert table["dyad"].to_pylist() == [row["dyad"] for row in rows]
    assert len(read_csv(tmp_path / "ticks.csv")) == 40
    both = read_csv(tmp_path / "wide.csv")
    assert [one["rounds-1.score"] for one in both] == ["20", "20"]
    assert [one["rounds-1.dyad"] for one in both] == [row["dyad"] for row in rows]
    assert [one["rounds_finished"] for one in read_csv(tmp_path / "participants.csv")] == ["1", "1"]


def test_trajectories_travel_in_a_zip(store: Store, tmp_path: Path) -> None:
    visit = begin(store)
    first = open_round(store, visit)
    play(store, first, one_soup())
    ada, bob = begin(store), begin(store)
    second = store.set_up_round(shared(ada, bob, 2)).result()
    finish(store, second, [one_soup(), joint_actions(3, 40)], "finished")
    assert export_trajectories(store, "demo", tmp_path / "all.zip") == 3
    with zipfile.ZipFile(tmp_path / "all.zip") as archive:
        names = archive.namelist()
        found = [from_text(archive.read(name).decode(), name) for name in names]
    assert names == [
        f"{visit.participant}-{first}.jsonl",
        f"{ada.participant}-{second}-1.jsonl",
        f"{ada.participant}-{second}-2.jsonl",
    ]
    assert found[2].joint_actions.tolist() == [list(pair) for pair in joint_actions(3, 40)]
    export_trajectories(store, "demo", tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == (tmp_path / "all.zip").read_bytes()


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_the_fields_own_package_reads_the_states(store: Store, tmp_path: Path, ending: str) -> None:
    visit = begin(store)
    round_id = open_round(store, visit)
    play(store, round_id, one_soup())
    ada, bob = begin(store), begin(store)
    finish(store, store.set_up_round(shared(ada, bob)).result(), [joint_actions(2, 40)], "finished")
    out = tmp_path / f"human.{ending}"
    assert export_human_data(store, "demo", out) == 80
    rows = read_csv(out) if ending == "csv" else pyarrow.parquet.read_table(out).to_pylist()
    assert list(rows[0]) == [field.name for field in HUMAN_DATA.fields]
    package = mdp()
    package.Recipe.configure({})
    for row in rows:
        stored = json.loads(row["state"])
        state = package.OvercookedState.from_dict(stored)
        assert json.loads(json.dumps(state.to_dict())) == stored
        actions = json.loads(row["joint_action"])
        assert all(tuple(a) in ((0, -1), (0, 1), (1, 0), (-1, 0), (0, 0)) or a == "interact" for a in actions)
    soups = [json.loads(row["state"])["objects"] for row in rows[:40]]
    assert [one["cooking_tick"] for objects in soups for one in objects if one["name"] == "soup"][-1] == 20
    last = rows[39]
    assert (int(last["reward"]), int(last["score"]), int(last["cur_gameloop"])) == (20, 20, 39)
    assert (last["trial_id"], last["player_0_id"], last["player_1_id"]) == (
        str(round_id),
        "chef-a",
        visit.participant,
    )
    assert (str(last["player_0_is_human"]).lower(), str(last["player_1_is_human"]).lower()) == (
        "false",
        "true",
    )
    assert (rows[40]["player_0_id"], rows[40]["player_1_id"]) == (ada.participant, bob.participant)
    assert json.loads(last["layout"])[1] == list("O   O")
