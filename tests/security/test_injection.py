"""Script in every text that anybody can write: no page lets it run."""

from __future__ import annotations

import html

import pytest

from tests.records.stored import stored_visit
from tests.security.conftest import Site
from tests.security.harmless import dangers
from tests.security.hostile import ALL, MARK, SCRIPTS


def check(text: str, *, shown: bool = True) -> None:
    assert dangers(text) == []
    if shown:
        assert MARK in html.unescape(text), "the hostile text is on this page"


def test_texts_of_a_study_run_nowhere(site: Site) -> None:
    check(site.served.client().get("/s/hostile").text)
    one = site.participant()
    check(one.page.text)
    seen = []
    one.agree()
    while one.stage != "round":
        seen.append(one.stage)
        check(one.page.text)
        filled = {"often": "2", "words": "x", "sentences": "y", "kind": "a"}
        one.submit(filled if one.stage == "questionnaire" else {})
    check(one.page.text)
    with one.play() as player:
        assert player.whole_round()["outcome"] == "finished"
    check(one.load().text)
    assert [*seen, one.stage] == ["questionnaire", "instructions", "debrief"]


@pytest.mark.parametrize("script", [*SCRIPTS, ALL])
def test_answers_run_nowhere(site: Site, script: str) -> None:
    one = site.participant()
    one.agree()
    fields = dict.fromkeys(("often", "words", "sentences", "kind", script, "skip_x"), script)
    one.submit(fields)
    assert one.page.status_code == 422
    check(one.page.text)
    one.submit({**fields, "often": "1", "kind": "b", "words": script[:80]})
    assert one.stage == "instructions"
    client = site.researcher()
    row = stored_visit(site.served.store, one.token)
    assert row is not None
    page = client.get(f"/researcher/visits/{row.id}")
    assert page.status_code == 200
    check(page.text)
    for path in ("/researcher", "/researcher/studies/hostile", "/researcher/studies/hostile/visits"):
        answer = client.get(path, params={"status": script, "sort": script, "page": script, "q": script})
        assert answer.status_code < 500
        check(answer.text, shown=False)


@pytest.mark.parametrize("script", SCRIPTS)
def test_links_run_nowhere(site: Site, script: str) -> None:
    http = site.served.client()
    for name in ("PROLIFIC_PID", "other", "language", "code", script):
        check(http.get("/s/hostile", params={name: script}).text)
        begun = http.post("/s/hostile/begin", params={name: script})
        assert begun.status_code == 200
        check(begun.text)
    for path in (f"/{script}", f"/s/{script}", f"/v/{script}", f"/researcher/login?next={script}"):
        answer = http.get(path)
        assert answer.status_code < 500
        check(answer.text, shown=False)
    token = begun.url.path.rsplit("/", 1)[1]
    row = stored_visit(site.served.store, token)
    assert row is not None
    check(site.researcher().get(f"/researcher/visits/{row.id}").text, shown=False)


def test_a_page_that_could_run_something_would_be_found() -> None:
    for script in (*SCRIPTS[:3], SCRIPTS[6].replace("<b>", "<blink>")):
        assert dangers(f"<main><p>{script}</p></main>"), script
    assert dangers(f'<a href="{SCRIPTS[3]}">x</a>')
    assert dangers(f"<input value='{SCRIPTS[5]}'>")
    assert dangers("<p>fine</p>") == []
