"""What the pages show and do: live numbers, filters, notes, states, erasing, downloads."""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from pathlib import Path

import pytest

from galley.files.scratch import Scratch
from galley.kitchen.trajectory import from_text
from galley.records.reading import overview
from galley.server.researcher import counts
from galley.server.researcher.downloads import DOWNLOADS
from galley.server.researcher.export_process import write_export
from galley.server.researcher.visit_pages import LONGEST_NOTE
from tests.records.stored import stored_visit
from tests.server.helpers import wait_until
from tests.server.researcher.office import HOSTILE, NAME, START_MS, Office, csrf
from tests.server.researcher.pilot import Pilot


def numbers(html: str) -> dict[str, str]:
    """The figures at the top of a page, by their names."""
    pairs = re.findall(r"<dt>([^<]+)</dt><dd[^>]*>(.*?)</dd>", html, re.DOTALL)
    return {name: re.sub(r"<[^>]+>", "", value).strip() for name, value in pairs}


def test_a_study_is_told_in_numbers(office: Office) -> None:
    researcher = office.researcher()
    shown = numbers(researcher.page("/studies/short"))
    told = {
        name: shown[name]
        for name in ("State", "Begun", "Under way", "Completed", "Left early", "Rounds now", "Tests")
    }
    assert list(told.values()) == ["open", "4", "1", "2", "1", "1", "1"]
    assert "A short visit" in researcher.page("")


def test_live_numbers_are_those_of_the_page(office: Office) -> None:
    researcher = office.researcher()
    page = researcher.page("/studies/short")
    parts = researcher.data("/studies/short/live.json")["parts"]
    assert set(parts) == {
        "numbers",
        "stages",
        "cells",
        "rounds",
        "flags",
        "arrivals",
        "arrivals_table",
    }
    for name, html in parts.items():
        assert f'data-part="{name}"' in page
        assert html.strip() in page
    assert "A short visit" in researcher.data("/live.json")["parts"]["studies"]


def test_stages_say_who_is_where(office: Office) -> None:
    rows = re.findall(
        r"<tr><td.*?</tr>", office.researcher().data("/studies/short/live.json")["parts"]["stages"], re.DOTALL
    )
    cells = [
        [re.sub(r"<[^>]+>", "", cell).strip() for cell in re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL)]
        for row in rows
    ]
    by_step = {row[0].split()[-1]: row[1:4] for row in cells}
    assert by_step["consent"] == ["4", "", ""]
    assert by_step["instructions"] == ["4", "", "1"]
    assert by_step["tutorial"] == ["3", "1", ""]


def test_visits_are_filtered(office: Office) -> None:
    researcher = office.researcher()

    def listed(query: str) -> set[str]:
        page = researcher.page(f"/studies/short/visits{query}")
        return {name for name, visit in office.visits.items() if visit.participant in page}

    assert listed("") == {"done", "hostile", "playing", "left"}
    assert listed("?status=completed") == {"done", "hostile"}
    assert listed("?status=timed_out") == {"left"}
    assert listed("?flagged=1") == {"done"}
    assert listed("?tests=1") == set(office.visits)
    assert listed("?status=nonsense&page=x") == {"done", "hostile", "playing", "left"}
    assert listed("?page=7") == set()
    assert listed("?page=99999999999999999999") == {"done", "hostile", "playing", "left"}


def test_a_visit_shows_flags_rounds_and_answers(office: Office) -> None:
    visit = office.visits["done"]
    page = office.researcher().page(f"/visits/{visit.id}")
    for words in (
        "hidden for 90 s",
        "ticks of the agent late",
        "PROLIFIC_PID",
        "How old are you?",
        "PILOT-1",
        "came to tutorial",
    ):
        assert words in page
    assert page.count(">Replay<") == 3


def test_whatever_people_wrote_is_shown_as_text(office: Office) -> None:
    researcher = office.researcher()
    visit = office.visits["hostile"]
    escaped = "&lt;script&gt;alert(1)&lt;/script&gt;"
    page = researcher.page(f"/visits/{visit.id}")
    # Link parameters, open answers, the note's author and its text, in the timeline too.
    assert page.count(escaped) >= 6
    paths = [
        f"/visits/{visit.id}",
        "",
        "/live.json",
        "/studies/short",
        "/studies/short/live.json",
        "/studies/short/visits",
        "/studies/short/rounds",
    ]
    for path in [*paths, f"/rounds/{office.open_round}"]:
        text = researcher.page(path)
        assert "<script>alert" not in text
        assert "onerror=alert(1)>" not in text.replace("&lt;img src=x onerror=alert(1)&gt;", "")
        assert "49" not in re.findall(r"\{\{7\*7\}\}|&gt;(49)", text)
    sent = researcher.send(f"/visits/{visit.id}/notes", text=HOSTILE * 80)
    assert sent.status_code == 422
    assert "<script>alert" not in sent.text
    wrong = researcher.send(f"/visits/{visit.id}/erase", confirm=HOSTILE)
    assert wrong.status_code == 422
    assert "<script>alert" not in wrong.text
    for query in (
        f"/studies/short/visits?status={HOSTILE}",
        f"/rounds/1/replay.json?after={HOSTILE}",
        f"/studies/{HOSTILE}",
    ):
        answer = researcher.http.get(f"/researcher{query}")
        assert answer.status_code < 500
        assert "<script>alert" not in answer.text


def test_a_note_is_signed_and_kept(office: Office) -> None:
    researcher = office.researcher()
    visit = office.visits["playing"]
    assert researcher.send(f"/visits/{visit.id}/notes", text="  Asked for help.\nTwice.  ").status_code == 303
    found = office.store.read(lambda connection: overview.notes(connection, visit.id)).result()
    assert [(note.author, note.text) for note in found] == [(NAME, "Asked for help.\nTwice.")]
    for text in ("", "   ", "x" * (LONGEST_NOTE + 1)):
        assert researcher.send(f"/visits/{visit.id}/notes", text=text).status_code == 422
    assert "Asked for help." in researcher.page(f"/visits/{visit.id}")


def test_a_study_is_paused_closed_and_opened(fresh: Office) -> None:
    researcher = fresh.researcher()
    for state in ("paused", "closed", "open"):
        assert researcher.send("/studies/short/state", state=state).status_code == 303
        assert fresh.store.study_state("short").result() == state
        assert numbers(researcher.page("/studies/short"))["State"] == state
    assert researcher.send("/studies/short/state", state="sleepy").status_code == 400
    assert researcher.send("/studies/none/state", state="closed").status_code == 404


def test_what_is_not_there_is_a_page_that_says_so(office: Office) -> None:
    researcher = office.researcher()
    huge = "9" * 40
    for path in (
        "/visits/999",
        f"/visits/{huge}",
        "/rounds/999",
        f"/rounds/{huge}",
        "/studies/none",
        "/studies/none/download/csv",
        "/studies/short/download/none",
    ):
        assert "no such" in researcher.page(path, 404)
    assert researcher.http.get(f"/researcher/rounds/{huge}/replay.json").status_code == 404
    assert researcher.http.get("/researcher/studies/none/live.json").status_code == 404
    assert researcher.send(f"/visits/{huge}/erase", confirm="x").status_code == 404


def test_a_round_under_way_can_be_watched(office: Office) -> None:
    researcher = office.researcher()
    assert 'data-live="1"' in researcher.page(f"/rounds/{office.open_round}")
    document = researcher.data(f"/rounds/{office.open_round}/replay.json?after=5")
    assert (document["status"], document["from"], document["ticks"], len(document["steps"])) == (
        "open",
        5,
        12,
        7,
    )
    assert (
        f"/researcher/rounds/{office.open_round}"
        in researcher.data("/studies/short/live.json")["parts"]["rounds"]
    )


def test_erasing_takes_the_name_typed_out_and_stops_the_match(fresh: Office) -> None:
    pilot = Pilot(fresh.store, fresh.workspace, fresh.study, START_MS)
    gone, kept = pilot.begin(), pilot.begin()
    pilot.walk(gone, 4)
    researcher = fresh.researcher()
    for wrong in ("", kept.participant, gone.participant.upper()):
        refused = researcher.send(f"/visits/{gone.id}/erase", confirm=wrong)
        assert refused.status_code == 422
        assert "Nothing was erased" in refused.text
    assert fresh.stopped == []
    done = researcher.send(f"/visits/{gone.id}/erase", confirm=gone.participant)
    assert done.status_code == 200
    assert "erased for good" in done.text
    assert fresh.stopped == [gone.id]
    assert stored_visit(fresh.store, gone.token) is None
    assert stored_visit(fresh.store, kept.token) is not None
    researcher.page(f"/visits/{gone.id}", 404)


def test_a11_an_erasure_whose_files_were_in_use_is_finished_by_sending_the_form_again(
    fresh: Office, monkeypatch: pytest.MonkeyPatch
) -> None:
    pilot = Pilot(fresh.store, fresh.workspace, fresh.study, START_MS)
    gone = pilot.begin()
    researcher = fresh.researcher()
    token = csrf(researcher.page(""))
    with monkeypatch.context() as patch:
        patch.setattr("galley.records.store.erase.SCRUB_S", 0.2)
        patch.setattr("galley.records.database.engine.BUSY_MS", 20)
        with fresh.store.reading() as connection:
            assert overview.visit(connection, gone.id) is not None
            refused = researcher.send(f"/visits/{gone.id}/erase", token, confirm=gone.participant)
        assert refused.status_code == 409
        assert "erase once more" in refused.text
    assert researcher.send(f"/visits/{gone.id}/erase", token, confirm="somebody").status_code == 404
    done = researcher.send(f"/visits/{gone.id}/erase", token, confirm=gone.participant)
    assert done.status_code == 200
    assert "erased for good: visits 1" in done.text
    assert researcher.send(f"/visits/{gone.id}/erase", token, confirm=gone.participant).status_code == 404


def test_a_download_is_a_file_made_now(office: Office) -> None:
    answer = office.researcher().http.get("/researcher/studies/short/download/csv", timeout=120)
    assert answer.status_code == 200, answer.text
    named = answer.headers["content-disposition"]
    assert re.fullmatch(r'attachment; filename="short-\d{8}-\d{6}\.csv\.zip"', named)
    assert answer.headers["cache-control"] == "no-store"
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        people = list(csv.DictReader(io.StringIO(archive.read("participants.csv").decode("utf-8-sig"))))
    told = {person["participant"] for person in people}
    assert told == {visit.participant for name, visit in office.visits.items() if name != "test"}


def test_a13_downloads_that_a_killed_server_left_go_with_the_next(
    office: Office, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    left, others = tmp_path / "galley-export-abcdefgh", tmp_path / "galley-other"
    for folder in (left, others):
        folder.mkdir()
        (folder / ".lock").touch()
    at_work = Scratch("galley-export-")
    answer = office.researcher().http.get("/researcher/studies/short/download/csv", timeout=120)
    assert answer.status_code == 200
    wait_until(lambda: set(tmp_path.iterdir()) == {others, at_work.path})


@pytest.mark.parametrize("kind", DOWNLOADS)
def test_every_kind_of_download_holds_the_records(office: Office, kind: str, tmp_path: Path) -> None:
    out = tmp_path / f"out.{DOWNLOADS[kind].ending}"
    write_export(str(office.database), "short", kind, True, out)
    visit = office.visits["done"]
    if kind == "human-data":
        rows = list(csv.DictReader(io.StringIO(out.read_text("utf-8-sig"))))
        assert len(rows) > 100
        assert {"state", "joint_action", "reward", "layout_name"} <= set(rows[0])
    elif kind == "human-data-parquet":
        assert out.read_bytes()[:4] == b"PAR1"
    else:
        with zipfile.ZipFile(out) as archive:
            names = archive.namelist()
            if kind == "trajectories":
                name = next(name for name in names if name.startswith(visit.participant))
                assert len(from_text(archive.read(name).decode(), name).joint_actions) == 40
            else:
                assert any(name.startswith("participants.") for name in names)
            if kind == "jsonl":
                lines = archive.read("participants.jsonl").decode().splitlines()
                people = {json.loads(line)["participant"] for line in lines}
                assert people == {visit.participant for visit in office.visits.values()}


def test_a_download_that_fails_says_why(office: Office, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("galley.server.researcher.downloads.sys.executable", "/bin/false")
    answer = office.researcher().http.get("/researcher/studies/short/download/csv")
    assert answer.status_code == 500
    assert "No file was made" in answer.text


def finished_round(office: Office) -> int:
    found = office.store.open_round(office.visits["done"].id, "rounds-1").result()
    assert found is not None
    return found.id


@pytest.mark.parametrize(
    ("ending", "media", "magic"), [("gif", "image/gif", b"GIF89a"), ("mp4", "video/mp4", b"ftyp")]
)
def test_a_round_is_downloaded_as_a_film(office: Office, ending: str, media: str, magic: bytes) -> None:
    researcher, round_id = office.researcher(), finished_round(office)
    path = f"/rounds/{round_id}/film.{ending}"
    assert f'href="/researcher{path}"' in researcher.page(f"/rounds/{round_id}")
    answer = researcher.http.get(f"/researcher{path}", timeout=120)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == media
    assert answer.headers["content-disposition"] == f'attachment; filename="short-round-{round_id}.{ending}"'
    assert magic in answer.content[:12]


def test_films_are_not_offered_where_none_can_be_made(
    office: Office, monkeypatch: pytest.MonkeyPatch
) -> None:
    researcher, round_id = office.researcher(), finished_round(office)
    assert "/film." not in researcher.page(f"/rounds/{office.open_round}")
    researcher.page(f"/rounds/{round_id}/film.exe", 404)
    researcher.page("/rounds/99999999999999999999/film.gif", 404)
    monkeypatch.setattr("galley.film.write.NEEDED", ("no_such_library",))
    assert "/film." not in researcher.page(f"/rounds/{round_id}")
    researcher.page(f"/rounds/{round_id}/film.gif", 404)


def test_flags_are_counted_as_the_list_shows_them(fresh: Office) -> None:
    pilot = Pilot(fresh.store, fresh.workspace, fresh.study, START_MS - 3_600_000)
    for test in (False, True, True):
        pilot.walk(pilot.begin(test=test), hidden_s=90)
    researcher = fresh.researcher()
    flagged = re.findall(
        r'<span class="flag flag-(\w+)">[^<]*</span></td><td class="n">(\d+)<',
        researcher.page("/studies/short"),
    )
    listed = re.findall(r'<span class="flag flag-(\w+)"', researcher.page("/studies/short/visits?flagged=1"))
    assert ("hidden_tab", "1") in flagged
    assert sum(int(count) for _, count in flagged) == len(listed)


def test_arrivals_are_counted_by_when_they_began() -> None:
    hour = 3_600_000
    start = 1_790_000_000_000 // hour * hour
    began = [(start + 5, "completed"), (start + hour - 1, "active"), (start + 30 * hour, "timed_out")]
    found = counts.arrivals(began)
    assert (found["span"], len(found["rows"])) == ("an hour", 31)
    kept = [
        (row["from_ms"], row["came"], row["done"], row["here"], row["gone"])
        for row in found["rows"]
        if row["came"]
    ]
    assert kept == [(start, 2, 1, 1, 0), (start + 30 * hour, 1, 0, 0, 1)]
    assert counts.arrivals(began[:2])["span"] == "10 minutes"
    long_after = (start + 40_000 * 24 * hour, "active")
    years = counts.arrivals([*began, long_after])
    assert (years["span"], sum(row["came"] for row in years["rows"])) == ("364 days", 4)
    assert counts.arrivals([])["rows"] == []


def test_arrivals_are_shown_as_a_chart_and_a_table_without_tests(office: Office) -> None:
    parts = office.researcher().data("/studies/short/live.json")["parts"]
    assert len(re.findall(r'<rect class="(?:done|here|gone)" x=', parts["arrivals"])) >= 2
    counts = re.findall(r'<td class="n">(\d+)</td>', parts["arrivals_table"])
    assert sum(map(int, counts[::4])) == 4


def test_test_links_are_made_shown_and_withdrawn(fresh: Office) -> None:
    researcher = fresh.researcher()
    answer = researcher.send("/studies/short/test-links", cell="")
    assert answer.status_code == 303
    page = researcher.page("/studies/short")
    found = re.search(r'value="(http://[^"]+/s/short\?galley-test=([^"]+))"', page)
    assert found
    assert len(found[2]) >= 32
    assert f"{NAME}, good until" in page
    assert researcher.send("/studies/short/test-links", cell="77").status_code == 400
    assert researcher.send("/studies/nothing/test-links", cell="").status_code == 404
    assert researcher.send("/studies/short/test-links/withdraw", link="other").status_code == 404
    assert researcher.send("/studies/short/test-links/withdraw", link=found[2]).status_code == 303
    assert "galley-test=" not in researcher.page("/studies/short")
    fresh.clock.at_s += 1
    researcher.send("/studies/short/test-links", cell="")
    fresh.clock.at_s += 6 * 86_400
    later = fresh.researcher()
    assert "galley-test=" in later.page("/studies/short")
    fresh.clock.at_s += 2 * 86_400
    assert "galley-test=" not in fresh.researcher().page("/studies/short")
