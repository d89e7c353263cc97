"""Erasing a participant: nothing of theirs is left anywhere, and nobody else is touched."""

from __future__ import annotations

import csv
import io
import threading
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from galley.errors import GalleyError
from galley.records import Arrival, KeyRow, Planned, Store, VisitRow
from galley.records.database import engine
from galley.records.export.study_export import export_study
from galley.records.export.trajectory_export import export_human_data, export_trajectories
from galley.records.reading import overview
from galley.records.reading.verify import verify_study
from galley.records.store import erase
from galley.records.store.erase import Erased, erase_participant
from galley.server.run import finish_what_was_begun
from tests import postgres
from tests.records.databases import Database
from tests.records.export.test_study_export import AFTER, COMPARE, answer
from tests.records.helpers import START_MS, begin, joint_actions, one_soup, open_round, plan, play
from tests.records.store.test_rounds import finish, shared
from tests.serving import run_galley

SECRET = "kohlrabi"


def person(store: Store, name: str) -> VisitRow:
    """A whole visit that says `name` wherever a person can leave words."""

    def planned(visit_no: int, slot: int | None) -> Planned:
        return Planned(visit_no, plan(visit_no).to_json().replace("Thank you", f"Thank {name}"), {"arm": "a"})

    params = {"PROLIFIC_PID": f"{name}-link"}
    arrival = Arrival("demo", "d" * 64, START_MS, params, "en", f"{name}-person", True)
    visit = store.begin_visit(arrival, planned).result().visit
    assert visit is not None
    play(store, open_round(store, visit, "tutorial"), joint_actions(5, 40), "skipped")
    play(store, open_round(store, visit), one_soup())
    answer(store, visit, "rounds-1-questions", AFTER, {"fluent": 6, "why": f"{name}-answer " * 300}, 20_000)
    answer(store, visit, "comparison", COMPARE, {"prefer": 2, "trust": 4}, 30_000)
    store.save_attempt(visit.id, "quiz", 1, {"word": f"{name}-attempt"}, START_MS).result()
    store.add_note(visit.id, "researcher", f"{name}-note", START_MS).result()
    store.hidden(visit.id, "consent", START_MS, START_MS + 5).result()
    return visit


def everything(store: Store, out: Path) -> dict[str, bytes]:
    """All exports of the study, by file name."""
    export_study(store, "demo", out, formats=("csv", "jsonl"))
    export_trajectories(store, "demo", out / "all.zip")
    export_human_data(store, "demo", out / "human.csv")
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


def without(content: bytes, participant: str) -> bytes:
    """An exported CSV or JSON Lines file without a participant's rows."""
    text = content.decode("utf-8")
    if text.startswith("{"):
        return "".join(line for line in text.splitlines(True) if participant not in line).encode()
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerows(row for row in csv.reader(io.StringIO(text, newline="")) if participant not in row)
    return out.getvalue().encode("utf-8")


def unzipped(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def files(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_exports_of_all_others_stay_byte_for_byte(store: Store, database: Database, tmp_path: Path) -> None:
    first, gone, last = person(store, "ada"), person(store, SECRET), person(store, "bob")
    before = everything(store, tmp_path / "before")
    rounds = database.rows("SELECT id, study FROM rounds ORDER BY id")
    assert erase_participant(store, gone.participant) == Erased(1, 2)
    after = everything(store, tmp_path / "after")
    assert before.keys() == after.keys()
    for name in before:
        if name.endswith(".zip"):
            left = {
                path: text for path, text in unzipped(before[name]).items() if gone.participant not in path
            }
            assert unzipped(after[name]) == left
        elif name.startswith("data-dictionary"):
            assert after[name] == before[name]
        else:
            assert after[name] == without(before[name], gone.participant), name
        assert SECRET.encode() not in after[name]
    assert verify_study(store, "demo").rounds == 4
    assert set(database.rows("SELECT id, study FROM rounds")) < set(rounds)
    for table in ("stages", "responses", "attempts", "absences", "notes", "seats"):
        assert database.rows(f"SELECT count(*) FROM {table} WHERE visit_id = {gone.id}") == [(0,)]
    new = person(store, "eve")
    assert new.id > last.id > first.id
    assert new.visit_no == 3, "no number is given out twice"


def test_nothing_is_left_in_the_files_of_sqlite(tmp_path: Path) -> None:
    folder = tmp_path / "records"
    with Store.open(folder / "galley.sqlite", serving=True) as store:
        for name in ("ada", SECRET, "bob"):
            person(store, name)
        (gone,) = (visit for visit in _visits(store) if SECRET in str(visit.link_params))
        row = store.read(lambda c: overview.visit(c, gone.id)).result()
        assert row is not None
        words = [SECRET.encode(), gone.participant.encode()]
        assert all(any(word in content for content in files(folder).values()) for word in words)
        erase_participant(store, gone.id)
        for path, content in files(folder).items():
            assert not any(word in content for word in words), path
        assert any(b"ada-answer" in content for content in files(folder).values())
        person(store, "eve")
    for path, content in files(folder).items():
        assert not any(word in content for word in words), path


def test_nothing_is_left_in_the_tables_of_postgresql(tmp_path: Path) -> None:
    with postgres.running() as server:
        server.execute("CREATE DATABASE records")
        with Store.open(server.url("records"), serving=True) as store:
            person(store, "ada")
            gone = person(store, SECRET)
            server.execute("CHECKPOINT")
            assert any(SECRET.encode() in content for content in files(server.data / "base").values())
            erase_participant(store, gone.participant)
            for path, content in files(server.data / "base").items():
                assert SECRET.encode() not in content, path
                assert gone.participant.encode() not in content, path


def _visits(store: Store) -> tuple[overview.VisitSummary, ...]:
    return store.read(lambda c: overview.visits(c, "demo")).result()


def test_a_round_for_two_stays_the_others(store: Store, database: Database, tmp_path: Path) -> None:
    ada, bob = begin(store), begin(store)
    round_id = store.set_up_round(shared(ada, bob)).result()
    keys = [KeyRow(1, "up", True, 1.0, START_MS + seat + 1.0, 0, seat) for seat in (0, 1)]
    store.journal(round_id, keys=keys)
    finish(store, round_id, [one_soup()], "finished")
    assert erase_participant(store, ada.participant) == Erased(1, 0)
    row = store.open_round(bob.id, "rounds-1").result()
    assert row is not None
    assert [seat.visit_id for seat in row.seats] == [None, bob.id]
    assert (row.human.visit_id, row.partner.agent) == (bob.id, None)
    assert database.rows("SELECT seat FROM keys") == [(1,)]
    assert verify_study(store, "demo").ok
    export_study(store, "demo", tmp_path)
    with (tmp_path / "rounds.csv").open(encoding="utf-8", newline="") as file:
        (told,) = csv.DictReader(file)
    assert (told["participant"], told["partner_participant"], told["partner_served"]) == (
        bob.participant,
        "",
        "1",
    )
    assert told["dyad"] == f"{bob.visit_no}+erased"
    assert export_human_data(store, "demo", tmp_path / "human.csv") == 40
    assert erase_participant(store, bob.id) == Erased(1, 1)
    assert database.rows("SELECT count(*) FROM ticks") == [(0,)]


def test_who_is_not_there_is_told(store: Store) -> None:
    with pytest.raises(GalleyError, match="no participant or visit 'nobody'"):
        erase_participant(store, "nobody")
    with pytest.raises(GalleyError, match="no participant or visit 7"):
        erase_participant(store, 7)


def test_a_journal_that_arrives_late_brings_nothing_back(store: Store, database: Database) -> None:
    visit = begin(store)
    round_id = open_round(store, visit)
    lease = store.lease_round(round_id, "a", 600).result()
    assert lease is not None
    erase_participant(store, visit.id)
    store.journal(round_id, keys=[KeyRow(1, "up", True, 1.0, START_MS + 1.0, 0, 1)], lease=lease)
    store.flush().result()
    assert (lease.lost, store.health().ok) == (True, True)
    assert database.rows("SELECT count(*) FROM keys") == [(0,)]


def test_a_reader_that_does_not_end_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(erase, "SCRUB_S", 0.2)
    monkeypatch.setattr(engine, "BUSY_MS", 20)
    with Store.open(tmp_path / "galley.sqlite") as store:
        visit = begin(store)
        with store.reading() as connection:
            assert overview.visit(connection, visit.id) is not None
            with pytest.raises(GalleyError, match="another program keeps reading"):
                erase_participant(store, visit.participant)
        assert erase_participant(store, visit.participant) == Erased(1, 0, before=True)
        with pytest.raises(GalleyError, match="no participant"):
            erase_participant(store, visit.participant)
        assert not any(visit.participant.encode() in content for content in files(tmp_path).values())


def test_rounds_are_journalled_while_somebody_is_erased(store: Store) -> None:
    gone, stays = person(store, SECRET), begin(store)
    round_id = open_round(store, stays)
    stop = threading.Event()
    written: list[int] = []

    def play_on(tell: Callable[[int], None] = written.append) -> None:
        while not stop.is_set():
            at_ms = float(START_MS + len(written))
            store.journal(round_id, keys=[KeyRow(len(written), "up", True, 1.0, at_ms, 0, 1)])
            tell(1)
            time.sleep(0.002)

    playing = threading.Thread(target=play_on)
    playing.start()
    try:
        erase_participant(store, gone.id)
    finally:
        stop.set()
        playing.join()
    store.flush().result()
    health = store.health()
    assert (health.ok, health.lost_rows) == (True, 0)
    assert len(written) > 0


def interrupted(store: Store, name: str = SECRET) -> VisitRow:
    """Somebody whose erasure was killed after the rows were gone."""
    visit = person(store, name)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(erase, "finish_erasures", lambda store: 0)
        assert erase_participant(store, visit.participant) == Erased(1, 2)
    return visit


def test_a11_an_erasure_that_was_killed_before_the_files_were_rewritten_is_finished(
    store: Store, database: Database
) -> None:
    visit = interrupted(store)
    assert len(database.rows("SELECT * FROM erasures")) == 1
    assert visit.participant not in str(database.rows("SELECT * FROM erasures"))
    assert erase_participant(store, visit.participant) == Erased(1, 2, before=True)
    assert database.rows("SELECT * FROM erasures") == []
    with pytest.raises(GalleyError, match="no participant"):
        erase_participant(store, visit.participant)
    with pytest.raises(GalleyError, match="no participant"):
        erase_participant(store, "somebody else")


def test_a11_the_next_erasure_finishes_those_before_it(tmp_path: Path) -> None:
    with Store.open(tmp_path / "galley.sqlite") as store:
        killed, other = interrupted(store), person(store, "ada")
        assert any(killed.participant.encode() in content for content in files(tmp_path).values())
        erase_participant(store, other.participant)
        assert not any(SECRET.encode() in content for content in files(tmp_path).values())
        assert not any(killed.participant.encode() in content for content in files(tmp_path).values())


def test_a11_the_command_says_what_it_finished(tmp_path: Path) -> None:
    database = tmp_path / "galley.sqlite"
    with Store.open(database) as store:
        visit = interrupted(store)
    command = ("erase", visit.participant, "--yes", "--database", database)
    done = run_galley(*command)
    told = f"{visit.participant} was erased before, now from the database's files too: visits=1 rounds=2\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, told, "")
    assert not any(SECRET.encode() in content for content in files(tmp_path).values())
    assert run_galley(*command).returncode == 1


def test_a11_a_server_that_starts_finishes_it(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with Store.open(tmp_path / "galley.sqlite", serving=True) as store:
        interrupted(store)
        finish_what_was_begun(store)
        assert "finished erasures that were interrupted: 1" in caplog.text
        assert not any(SECRET.encode() in content for content in files(tmp_path).values())
        caplog.clear()
        finish_what_was_begun(store)
        assert caplog.text == ""
