"""Nothing is lost: the records of an earlier version are migrated, served, verified and exported as before.

`earlier/` holds a whole study that people walked and what the version before made of it. What cannot be
compared with a study that is walked today is named below: it follows the clock, chance or how quick the
machine is.
"""

from __future__ import annotations

import csv
import io
import json
import lzma
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing
from pathlib import Path
from zipfile import ZipFile

import pytest

from galley.kitchen.measures import measures
from galley.kitchen.trajectory import read
from galley.records.export.columns import SHEETS
from tests import serving
from tests.records.earlier import lived
from tests.records.earlier.lived import FrontDoor, Office, Person

BEFORE = lived.HERE / "c05f99f"
STEPS = ("alone", "practice", *(f"games-{n}" for n in (1, 2, 3, 4)), "twice-5", "pair-6")
ADDED: Mapping[str, frozenset[str]] = {
    "participants": frozenset({"bonus", "bonus_unit"}),
    "responses": frozenset({"subscale", "subscale_value", "dyad", "start"}),
    "rounds": frozenset({"dyad", "bonus", "bonus_unit"}),
    "subscales": frozenset({"dyad"}),
    "wide": frozenset({"about.subscale.mood", "load.subscale.workload"})
    | {f"{step}.{name}" for step in STEPS for name in ("dyad", "bonus")},
}
"""Columns, by sheet, that exports have gained since; all others stand as they stood, in their order."""

CLOCK = {"begun_utc", "ended_utc", "last_seen_utc", "entered_utc", "left_utc", "answered_utc", "started_utc"}
CLOCK |= {"written_utc", "sent_utc", "deadline_utc", "duration_s", "hidden_s", "paused_s", "decision_ms"}
CLOCK |= {f"lateness_{name}ms" for name in ("", "median_", "p99_", "max_")} | {"decision_p99_ms"}
CHANCE = {"participant", "partner_participant", "round_id", "views", "late_ticks"}
"""Names that the server draws; what is counted while people wait for each other; late answers of an agent."""
KEYED = ("practice", "pair")
"""Rounds in which keys are pressed: when each arrives decides what is played."""
PLAYED = {"ticks", "score", "deliveries", "goal_reached", "stand_in_tick", "replays", "rtt_median_ms"}
PLAYED |= {f"{who}_{what}" for who in ("human", "partner") for what in ("ingredients", "dishes", "served")}
PLAYED |= {"human_blocked", "partner_blocked", "concurrent_ticks", "stuck_ticks", "delivery_ticks"}
RETOLD = {"consent_sha256"}
"""The words agreed to tell the minutes and rounds of a visit's own condition since (D1)."""
ONLY_THEIR_COLUMNS = ("keys", "pauses", "clocks")
"""Sheets whose rows are all made of moments."""

NAMES = sorted({file.name.split(".")[0] for file in BEFORE.glob("*.csv.xz")} - {"human-data"})
Rows = list[dict[str, str]]
Round = tuple[str, str]
"""(number of a visit, step): who played it, and which it was."""


def restored(file: Path) -> Path:
    """The database as the version before left it, in a new file."""
    with closing(sqlite3.connect(file)) as connection:
        connection.executescript(lzma.decompress((BEFORE / "whole.sql.xz").read_bytes()).decode())
    return file


def before(name: str) -> Rows:
    text = lzma.decompress((BEFORE / f"{name}.csv.xz").read_bytes()).decode()
    return list(csv.DictReader(io.StringIO(text, newline="")))


@pytest.fixture(scope="module")
def old(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of before; it is only read."""
    return restored(tmp_path_factory.mktemp("old") / "galley.sqlite")


@pytest.fixture(scope="module")
def today(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What is exported of the same study, lived through anew."""
    folder = tmp_path_factory.mktemp("today")
    lived.live(folder / "galley.sqlite")
    assert lived.verified(folder / "galley.sqlite").endswith("mismatched=0")
    lived.export(folder / "galley.sqlite", folder / "out")
    return folder / "out"


def same_columns(name: str, was: Rows, now: Rows, as_they_came: bool = False) -> Rows:
    """The rows of now without what was added on purpose.

    The wide sheet has its columns in the order in which people came to the steps, `as_they_came`.
    """
    added = ADDED.get(name, frozenset())
    found, wanted = [column for column in now[0] if column not in added], list(was[0])
    assert (sorted(found) == sorted(wanted)) if as_they_came else (found == wanted), name
    return [{column: value for column, value in row.items() if column not in added} for row in now]


def as_told_before(name: str, rows: Rows) -> Rows:
    """The rows without what rounds for two gained: a row of the second person (D7), the hat seen (D6)."""
    if name != "rounds":
        return rows
    once = {row["round_id"]: row for row in reversed(rows)}
    first = [row for row in rows if row is once[row["round_id"]]]
    return [row | ({} if row["agent"] else {"partner_hat": ""}) for row in first]


@pytest.fixture(scope="module")
def exported(old: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Everything that can be exported of it."""
    out = tmp_path_factory.mktemp("exported")
    lived.export(old, out, "--trajectories", "--human-data", "--format", "csv", "--format", "parquet")
    return out


def test_its_exports_are_what_they_were(exported: Path) -> None:
    assert set(NAMES) <= {sheet.name for sheet in SHEETS}
    for name in NAMES:
        was, now = before(name), lived.sheet(exported / f"{name}.csv")
        assert as_told_before(name, same_columns(name, was, now)) == as_told_before(name, was), name


def test_d6_d7_its_rounds_for_two_have_the_row_of_the_other_with_the_hats_they_saw(
    exported: Path, old: Path
) -> None:
    rows = [row for row in lived.sheet(exported / "rounds.csv") if row["dyad"]]
    assert len(rows) == 4
    with closing(sqlite3.connect(old)) as connection:
        plans = dict(connection.execute("SELECT participant, plan_json FROM visits"))
    for row in rows:
        other = next(r for r in rows if r["round_id"] == row["round_id"] and r is not row)
        assert (row["partner_participant"], row["dyad"]) == (other["participant"], other["dyad"])
        assert row["human_served"] == other["partner_served"]
        assert {row["human_seat"], other["human_seat"]} == {"0", "1"}
        steps = json.loads(plans[row["participant"]])["steps"]
        shown = next(step["data"]["partner_hat"] for step in steps if step["id"] == row["step"])
        assert row["partner_hat"] == shown


def test_every_round_still_replays_to_its_last_state(old: Path) -> None:
    assert lived.verified(old) == json.loads((BEFORE / "told.json").read_text(encoding="utf-8"))["verified"]


def test_its_human_data_are_what_they_were(exported: Path) -> None:
    assert lived.sheet(exported / "human-data.csv") == before("human-data")


def test_its_trajectories_are_what_they_were(exported: Path, tmp_path: Path) -> None:
    with ZipFile(exported / "trajectories.zip") as packed:
        packed.extractall(tmp_path)
    files = sorted(tmp_path.glob("*.jsonl"))
    scores = [row["score"] for row in before("rounds")]
    assert sum(measures(read(file)).score for file in files) == sum(int(score or 0) for score in scores)
    # A round of two episodes has two; one that was left out before its first tick has none.
    assert len(files) == len(scores) + 5
    was = read(BEFORE / "mixed-soups.jsonl")
    now = next(one for one in map(read, files) if one.seed == was.seed)
    assert (now.layout, now.seats) == (was.layout, was.seats)
    assert (now.joint_actions == was.joint_actions).all()
    assert measures(was).score == 20


@pytest.fixture(scope="module")
def door(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FrontDoor]:
    """A server on the records of before."""
    database = restored(tmp_path_factory.mktemp("served") / "galley.sqlite")
    with serving.served(lived.WORKSPACE, str(database)) as server, ExitStack() as opened:
        yield FrontDoor(server.url, opened)


@pytest.mark.parametrize(("name", "here"), [("answering", "games-1-questions"), ("playing", "games")])
def test_who_is_in_the_middle_of_a_visit_goes_on_to_the_end(door: FrontDoor, name: str, here: str) -> None:
    person = Person(door, name)
    person.waits = False
    tokens = json.loads((BEFORE / "told.json").read_text(encoding="utf-8"))["tokens"]
    assert (person.token, person.here) == (tokens[name], here)
    person.go_on()
    assert "WHOLE-1" in person.page.text


def test_researchers_open_every_page_of_it(door: FrontDoor) -> None:
    office = Office(door)
    studies = [f"/studies/{lived.STUDY}{path}" for path in ("", "/visits", "/rounds", "/live.json")]
    visits = [f"/visits/{number}" for number in range(1, 12)]
    rounds = [f"/rounds/{row['round_id']}" for row in before("rounds")]
    for path in ("", "/live.json", *studies, *visits, *rounds, *(f"{path}/replay.json" for path in rounds)):
        office.page(path)
    assert "=2+2 asked what a tomato is" in office.page("/visits/5")


def test_the_same_study_walked_today_is_exported_as_before(today: Path) -> None:
    was_rounds, now_rounds = before("rounds"), lived.sheet(today / "rounds.csv")
    equal = {of(row) for row in was_rounds if settled(row)} & {of(row) for row in now_rounds if settled(row)}
    assert {step.partition("-")[0] for _, step in equal} == {"alone", "games", "twice"}
    for name in NAMES:
        was = before(name)
        now = same_columns(name, was, lived.sheet(today / f"{name}.csv"), as_they_came=name == "wide")
        was, now = as_told_before(name, was), as_told_before(name, now)
        if name not in ONLY_THEIR_COLUMNS:
            assert comparable(name, now, now_rounds, equal) == comparable(name, was, was_rounds, equal), name


def comparable(name: str, rows: Rows, rounds: Rows, equal: set[Round]) -> Rows:
    """What must be equal: all but what follows the clock or chance; what was played, in `equal` rounds."""
    if name in ("ticks", "events"):
        known = {row["round_id"]: of(row) for row in rounds if of(row) in equal}
        mine = [row for row in rows if row["round_id"] in known]
        return [without(row, CLOCK | CHANCE) | {"of": str(known[row["round_id"]])} for row in mine]
    if name == "rounds":
        return [without(row, CLOCK | CHANCE | (set() if of(row) in equal else PLAYED)) for row in rows]
    if name == "wide":
        return [
            without(row, CLOCK | CHANCE | {column for column in row if played_apart(row, column, equal)})
            for row in rows
        ]
    rows = [without(row, CLOCK | CHANCE | RETOLD) for row in rows]
    return [row | {"flags": in_time(row["flags"])} if "flags" in row else row for row in rows]


def in_time(flags: str) -> str:
    """Flags without those that a busy machine earns."""
    return " | ".join(flag for flag in flags.split(" | ") if flag not in ("late_agent", "slow_client"))


def of(row: Mapping[str, str]) -> Round:
    return row["visit_no"], row["step"]


def settled(row: Mapping[str, str]) -> bool:
    """Whether a round was played to its end by agents who answered in time and people who pressed no key."""
    return row["status"] == "finished" and row["late_ticks"] == "0" and not row["step"].startswith(KEYED)


def played_apart(row: Mapping[str, str], column: str, equal: set[Round]) -> bool:
    """Whether a column of the wide sheet tells what was played in a round that cannot be compared."""
    step, _, name = column.partition(".")
    return name in PLAYED and (row["visit_no"], step) not in equal


def without(row: Mapping[str, str], names: set[str]) -> dict[str, str]:
    return {column: value for column, value in row.items() if column not in names}
