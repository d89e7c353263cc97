"""Test links: a researcher walks the running study, marked as a test, counted nowhere."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from galley.records import Store
from galley.records.export.study_export import export_study
from galley.records.store import links_for_tests as links
from galley.server.participant.visits import TEST_PARAM
from tests.server.helpers import Participant, Served, serving
from tests.server.participant.test_flow import row_of
from tests.study.workspaces import study_workspace

STUDY = """
format: 1
title: One place
seed: 4
tick_ms: 20
horizon_ticks: 25
countdown_s: 0
quota: 1
factors:
  partner: {levels: [random, stay]}
recruitment: {invitations: friends}
completion: {code: DONE-1}
stages:
  - {kind: consent, text: consent}
  - {kind: rounds, agents: [$partner], layouts: [{layout: cramped_room}]}
  - {kind: debrief, text: debrief}
"""
NOW_MS = 1_790_000_000_000.0
FOREVER_MS = 9e15


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("tested")
    workspace = study_workspace(folder / "lab", STUDY)
    (workspace.path / "invitations").mkdir(exist_ok=True)
    (workspace.path / "invitations" / "friends.txt").write_text(
        "code-ada\ncode-bob\ncode-cid\n", encoding="utf-8"
    )
    with serving(workspace, folder / "records.sqlite") as up:
        yield up


def made(store: Store, cell: int | None = None, expires_ms: float = FOREVER_MS) -> str:
    link = links.LinksForTests(store).make("mine", cell, "ada", NOW_MS, expires_ms).result()
    return f"?{TEST_PARAM}={link.token}"


def walk(person: Participant) -> None:
    assert person.stage == "consent"
    assert "Test visit: it is not counted" in person.page.text
    person.agree()
    with person.play() as player:
        assert player.whole_round()["outcome"] == "finished"
    person.load()
    assert "DONE-1" in person.page.text


def test_a_test_visit_counts_nowhere_though_the_study_is_full_and_closed(
    served: Served, tmp_path: Path
) -> None:
    query = made(served.store)
    for code in ("code-ada", "code-bob"):
        person = Participant(served, query=f"?code={code}")
        person.agree()
        with person.play() as player:
            player.whole_round()
        assert row_of(person).status == "completed"
    assert "Enough people have taken part" in served.client().post("/s/mine/begin?code=code-cid").text
    served.store.set_study_state("mine", "closed", 0).result()
    try:
        landing = served.client().get(f"/s/mine{query}")
        assert "Test visit: it is not counted" in landing.text
        assert f"/s/mine/begin{query}" in landing.text
        tester = Participant(served, query=query)
        walk(tester)
        walk(Participant(served, query=query))
    finally:
        served.store.set_study_state("mine", "open", 0).result()
    row = row_of(tester)
    assert (row.test, row.slot, row.status) == (True, None, "completed")
    assert TEST_PARAM not in row.link_params
    assert "Enough people have taken part" in served.client().post("/s/mine/begin?code=code-cid").text
    for tests in (False, True):
        export_study(served.store, "mine", tmp_path / str(tests), include_test=tests)
        with (tmp_path / str(tests) / "participants.csv").open(newline="", encoding="utf-8") as file:
            rows = {one["participant"]: one["test"] for one in csv.DictReader(file)}
        assert rows.get(row.participant) == ("true" if tests else None)
        assert [test for name, test in rows.items() if name != row.participant].count("false") == 2


def test_a_link_of_a_cell_leads_there(served: Served) -> None:
    met = {
        cell: {
            row_of(Participant(served, query=made(served.store, cell))).condition["partner"] for _ in range(3)
        }
        for cell in (0, 1)
    }
    assert met == {0: {"random"}, 1: {"stay"}}


@pytest.mark.parametrize("bad", ["", "x", "' OR 1=1 --"])
def test_a_link_that_is_not_good_never_begins_a_visit_that_counts(served: Served, bad: str) -> None:
    with served.store.reading() as connection:
        before = connection.exec_driver_sql("SELECT count(*) FROM visits").scalar_one()
    http = served.client()
    for answer in (
        http.get("/s/mine", params={TEST_PARAM: bad, "code": "code-cid"}),
        http.post("/s/mine/begin", params={TEST_PARAM: bad, "code": "code-cid"}),
    ):
        assert answer.status_code == 403
        assert "This test link is not good any more" in answer.text
    with served.store.reading() as connection:
        assert connection.exec_driver_sql("SELECT count(*) FROM visits").scalar_one() == before


def refused(served: Served, query: str) -> httpx.Response:
    return served.client().get(f"/s/mine{query}")


def test_links_expire_and_can_be_withdrawn(served: Served) -> None:
    assert refused(served, made(served.store, expires_ms=NOW_MS - 1)).status_code == 403
    query = made(served.store)
    assert refused(served, query).status_code == 200
    token = query.partition("=")[2]
    store = links.LinksForTests(served.store)
    assert store.find("other", token, NOW_MS).result() is None, "a link is for one study"
    assert store.withdraw("mine", token).result() is True
    assert store.withdraw("mine", token).result() is False
    assert refused(served, query).status_code == 403
