"""Links as recruiters hand them out: ids that are missing or placeholders, and studies that have no room."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.records import VisitRow
from galley.records.reading.flags import flags
from galley.records.store import queries
from tests.server.helpers import Participant, Served, serving
from tests.study.workspaces import short_workspace

RECRUITED = """\
format: 1
title: Two pages
seed: 3
recruitment: {participant: PROLIFIC_PID}
completion: {code: DONE-1}
stages:
  - {kind: consent, text: consent}
  - {kind: debrief, text: debrief}
"""
LENIENT = RECRUITED.replace("PROLIFIC_PID}", "PROLIFIC_PID, required: false}")
ROOMS = """\
endings:
  full: {code: FULL-1, redirect: "https://recruiter.example/back?cc={code}&pid={PROLIFIC_PID}"}
  later: {code: LATER-1}
  paused: {code: PAUSED-1}
  closed: {code: CLOSED-1, text: debrief}
  incomplete: {code: LINK-1}
quota: 1
"""
FULL = RECRUITED.replace("stages:", ROOMS + "stages:", 1)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder: Path = tmp_path_factory.mktemp("arrivals")
    workspace = short_workspace(folder / "lab")
    for name, text in (("recruited", RECRUITED), ("lenient", LENIENT), ("room", FULL)):
        (workspace.folder("studies") / f"{name}.yaml").write_text(text, encoding="utf-8")
    with serving(workspace, folder / "records.sqlite") as up:
        yield up


def row_of(person: Participant) -> VisitRow:
    """The stored visit of a participant."""
    with person.served.store.reading() as connection:
        row = queries.visit(connection, person.token)
    assert row is not None
    return row


PLACEHOLDERS = (
    "%7B%7B%25PROLIFIC_PID%25%7D%7D",
    "undefined",
    "null",
    "[id]",
    "PROLIFIC_PID",
    "$%7Be://Field/PID%7D",
)


@pytest.mark.parametrize("value", PLACEHOLDERS)
def test_f1_two_people_behind_a_placeholder_never_share_a_visit(served: Served, value: str) -> None:
    link = f"?PROLIFIC_PID={value}"
    page = served.client().get(f"/s/recruited{link}")
    assert page.status_code == 403
    assert "This link is not complete" in page.text
    assert served.client().post(f"/s/recruited/begin{link}").status_code == 403
    first, second = Participant(served, "lenient", link), Participant(served, "lenient", link)
    assert first.path != second.path
    assert row_of(first).person is None
    with served.store.reading() as connection:
        found = flags(connection, "lenient")
    assert "no_id" in {flag.kind for flag in found[row_of(first).id]}


@pytest.mark.parametrize("link", ["", "?PROLIFIC_PID=", "?PROLIFIC_PID=%20", "?prolific_pid=abc"])
def test_f7_d3_a_link_without_the_id_makes_no_visit(served: Served, link: str) -> None:
    with served.store.reading() as connection:
        before = flags(connection, "recruited")
    assert served.client().get(f"/s/recruited{link}").status_code == 403
    assert served.client().post(f"/s/recruited/begin{link}").status_code == 403
    person = Participant(served, "recruited", "?PROLIFIC_PID=somebody")
    assert Participant(served, "recruited", "?PROLIFIC_PID=somebody").path == person.path
    with served.store.reading() as connection:
        assert flags(connection, "recruited") == before


def test_f5_who_finds_no_room_has_a_page_with_code_and_way_back_before_begin(served: Served) -> None:
    first = Participant(served, "room", "?PROLIFIC_PID=one")
    late = served.client().get("/s/room?PROLIFIC_PID=two")
    assert "All places are taken just now" in late.text
    assert "LATER-1" in late.text
    assert ">Begin<" not in late.text
    again = served.client().get("/s/room?PROLIFIC_PID=one")
    assert ">Begin<" in again.text
    assert Participant(served, "room", "?PROLIFIC_PID=one").path == first.path
    for state, code in (("paused", "PAUSED-1"), ("closed", "CLOSED-1")):
        served.store.set_study_state("room", state, 0.0).result()
        for answer in (
            served.client().get("/s/room?PROLIFIC_PID=three"),
            served.client().post("/s/room/begin?PROLIFIC_PID=three"),
        ):
            assert code in answer.text
        assert Participant(served, "room", "?PROLIFIC_PID=one").path == first.path
    served.store.set_study_state("room", "open", 0.0).result()
    assert "LINK-1" in served.client().get("/s/room").text


def test_f5_a_full_study_sends_people_back_with_their_id(served: Served) -> None:
    Participant(served, "room", "?PROLIFIC_PID=one").agree()
    page = served.client().get("/s/room?PROLIFIC_PID=two")
    assert "This study is full" in page.text
    assert "FULL-1" in page.text
    assert "https://recruiter.example/back?cc=FULL-1&amp;pid=two" in page.text
