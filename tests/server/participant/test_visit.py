"""A whole visit over HTTP and sockets, against a real server with a real database."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import httpx
import pytest

from galley.errors import GalleyError
from galley.kitchen import Kitchen, Layout
from galley.records.database.tables import RESPONSES, STAGES
from galley.records.store import queries
from galley.study.study import load_study
from tests.records.stored import stored_answers, stored_visit
from tests.server.helpers import QUICK, Participant, Served, good_answers, serving
from tests.study.workspaces import study_workspace


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("visit")
    with serving(study_workspace(folder / "lab", QUICK), folder / "records.sqlite") as up:
        yield up


def answer(person: Participant, questionnaire: str) -> httpx.Response:
    return person.submit(
        good_answers(load_study(person.served.workspace, "mine").questionnaires[questionnaire])
    )


def at_the_survey(served: Served) -> Participant:
    person = Participant(served)
    person.agree()
    return person


def at_the_tutorial(served: Served) -> Participant:
    person = at_the_survey(served)
    answer(person, "before-game")
    person.submit()
    return person


def test_a_whole_visit_from_the_landing_page_to_the_completion_code(served: Served) -> None:
    http = served.client()
    landing = http.get("/?PROLIFIC_PID=abc")
    assert landing.url.path == "/s/mine"
    assert 'data-stage="landing"' in landing.text
    offered = http.get("/s/mine?PROLIFIC_PID=abc")
    assert "/s/mine/begin?PROLIFIC_PID=abc" in offered.text
    person = Participant(served, query="?PROLIFIC_PID=abc")
    pages = [person.page.text]
    stages = [person.stage]
    sent: list[str] = []
    while person.stage != "debrief":
        match person.stage:
            case "consent":
                person.agree()
            case "questionnaire":
                answer(person, "before-game" if person.step == "survey" else "after-round")
            case "comparison":
                answer(person, "comparison")
            case "instructions":
                person.submit()
            case "round":
                with person.play() as player:
                    ended = player.whole_round()
                    sent += [str(message) for message in player.received]
                assert ended["outcome"] == "finished"
                assert ended["next"] == person.path
                person.load()
        assert person.page.status_code == 200
        pages.append(person.page.text)
        stages.append(person.stage)
    assert stages == [
        "consent",
        "questionnaire",
        "instructions",
        "round",
        *["round", "questionnaire"] * 2,
        "comparison",
        "debrief",
    ]
    assert "QUICK-1" in pages[-1]
    told = " ".join([*pages, *sent]).lower()
    for secret in ("myopic", "random", ".onnx", "agent.yaml"):
        assert secret not in told, f"the browser was told of {secret}"

    row = stored_visit(served.store, person.token)
    assert row is not None
    assert (row.status, row.completion_code, row.link_params) == (
        "completed",
        "QUICK-1",
        {"PROLIFIC_PID": "abc"},
    )
    with served.store.reading() as connection:
        rounds = [queries.round_row(connection, n) for n in queries.rounds_of_visit(connection, row.id)]
        answers = connection.execute(RESPONSES.select().where(RESPONSES.c.visit_id == row.id)).all()
        left = connection.execute(STAGES.select().where(STAGES.c.visit_id == row.id)).all()
    assert [len(r.joint_actions) for r in rounds if r] == [10, 25, 25]
    for round_ in rounds:
        assert round_ is not None
        assert (round_.status, round_.human.visit_id) == ("finished", row.id)
        layout = Layout.from_dict(json.loads(round_.layout_json))
        kitchen = Kitchen(layout)
        for joint in round_.joint_actions.tolist():
            kitchen.step(*joint)
        assert kitchen.score == round_.score
        assert set(round_.joint_actions[:, round_.human.seat].tolist()) - {4}, "the keys did something"
    assert len({item.step_id for item in answers}) == 4
    assert [stage.step_id for stage in left if stage.left_ms is None] == ["debrief"]
    assert len(left) == 10


def test_declining_ends_the_visit(served: Served) -> None:
    person = Participant(served)
    page = person.submit({"choice": "decline"})
    assert (page.status_code, person.stage) == (200, "ending")
    assert person.submit({"choice": "agree"}, step="consent").text == page.text
    row = stored_visit(served.store, person.token)
    assert row is not None
    assert (row.status, row.consent_sha256) == ("declined", None)


def test_consent_without_a_choice_changes_nothing(served: Served) -> None:
    person = Participant(served)
    person.submit({"choice": "maybe"})
    assert person.stage == "consent"


def test_answers_out_of_range_are_shown_again_with_nothing_lost(served: Served) -> None:
    person = at_the_survey(served)
    questionnaire = load_study(served.workspace, "mine").questionnaires["before-game"]
    fields = good_answers(questionnaire)
    texts = [item.id for item in questionnaire.items if item.kind in ("short_text", "long_text", "number")]
    wrong = next(item for item in questionnaire.items if item.kind in ("likert", "number", "single_choice"))
    page = person.submit({**fields, wrong.id: "9999"})
    assert page.status_code == 422
    assert person.stage == "questionnaire"
    assert f'name="{wrong.id}"' in page.text
    for name in texts:
        if name != wrong.id:
            assert f'value="{fields[name]}"' in page.text or str(fields[name]) in page.text
    assert "<b>salt</b>" not in page.text
    nothing = person.submit()
    assert nothing.status_code == 422
    row = stored_visit(served.store, person.token)
    assert row is not None
    assert row.step_index == 1
    assert answer(person, "before-game").status_code == 200
    assert person.stage == "instructions"


def test_a_form_of_another_step_or_sent_twice_changes_nothing(served: Served) -> None:
    person = at_the_survey(served)
    person.submit({"choice": "decline"}, step="consent")
    assert person.stage == "questionnaire"
    person.submit(step="debrief")
    assert person.stage == "questionnaire"
    answer(person, "before-game")
    assert person.stage == "instructions"
    person.submit(
        good_answers(load_study(served.workspace, "mine").questionnaires["before-game"]), step="survey"
    )
    assert person.stage == "instructions"


def test_a_practice_that_may_be_skipped_is_skipped_and_a_round_is_not(served: Served) -> None:
    person = at_the_tutorial(served)
    assert person.stage == "round"
    assert person.step == "tutorial"
    person.submit({"skip": "1"})
    assert person.stage == "round"
    row = stored_visit(served.store, person.token)
    assert row is not None
    assert row.step_index == 4
    person.submit({"skip": "1"}, step="rounds-1")
    after = stored_visit(served.store, person.token)
    assert after is not None
    assert after.step_index == 4


def test_skipping_while_the_practice_is_played_ends_it_there(served: Served) -> None:
    person = at_the_tutorial(served)
    with person.play() as player:
        player.hello()
        player.send("ready")
        player.until("tick")
        person.submit({"skip": "1"}, step="tutorial")
        assert player.until("ended")["outcome"] == "skipped"


@pytest.mark.parametrize(
    "path", ["/v/nobody", "/v/" + "x" * 300, "/s/nothing", "/nowhere", "/v/%00", "/static/no.js"]
)
def test_unknown_addresses_get_a_plain_page(served: Served, path: str) -> None:
    http = served.client()
    page = http.get(path)
    assert page.status_code == 404
    assert 'data-stage="plain"' in page.text


def test_methods_that_are_not_offered_get_a_plain_page(served: Served) -> None:
    http = served.client()
    assert http.post("/v/nobody", data={"step": "x"}).status_code == 404
    assert http.delete("/s/mine").status_code == 405
    assert http.post("/s/nothing/begin").status_code == 404


def test_forms_that_cannot_be_read_are_refused_and_lose_nothing(served: Served) -> None:
    person = at_the_survey(served)
    http = person.http
    assert http.post(person.path, json={"step": "survey"}).status_code == 415
    assert http.post(person.path, data={"step": "survey", "x": "y" * 400_000}).status_code == 413
    assert http.post(person.path, data={f"f{n}": "1" for n in range(2000)}).status_code == 400
    assert http.post(person.path, content=b"step=survey&%ff%00=%zz").status_code == 422
    person.load()
    assert person.stage == "questionnaire"


LONG = """\
format: 1
title: Tell us more
source: made for this test
items:
  - {id: one, kind: long_text, text: First part, max_length: 20000, required: false}
  - {id: two, kind: long_text, text: Second part, max_length: 20000, required: false}
"""
ASKED = """\
format: 1
title: Long answers
seed: 1
completion: {code: LONG-1}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, id: survey, questionnaire: long-answers}
  - {kind: debrief, text: debrief}
"""


def test_f14_a_page_takes_the_longest_answers_that_it_allows(tmp_path: Path) -> None:
    workspace = study_workspace(tmp_path / "lab", ASKED)
    (workspace.folder("questionnaires") / "long-answers.yaml").write_text(LONG, encoding="utf-8")
    answers = dict.fromkeys(("one", "two"), "一" * 20000)
    with serving(workspace, tmp_path / "records.sqlite") as served:
        person = Participant(served)
        person.agree()
        beyond = person.submit({name: words * 3 for name, words in answers.items()})
        assert beyond.status_code == 413
        assert "Your answers are longer than this page takes." in beyond.text
        person.load()
        person.submit(answers)
        assert person.stage == "debrief"
        row = stored_visit(served.store, person.token)
        assert row is not None
        assert stored_answers(served.store, row.id)["survey"] == answers


def test_f23_a_picture_of_the_study_is_served(tmp_path: Path) -> None:
    workspace = study_workspace(tmp_path / "lab", ASKED.replace("long-answers", "before-game"))
    content = b"\x89PNG\r\n\x1a\n" + bytes(100)
    (workspace.folder("texts") / "logo.png").write_bytes(content)
    (workspace.folder("texts") / "consent.md").write_text("# Welcome\n\n![Our logo](logo.png)\n")
    with serving(workspace, tmp_path / "records.sqlite", base_path="/kitchen") as served:
        person = Participant(served)
        found = re.search(
            r'<img [^>]*src="/kitchen(/pictures/[0-9a-f]{32}\.png)" alt="Our logo"', person.page.text
        )
        assert found is not None
        picture = served.client().get(found[1])
        assert (picture.content, picture.headers["content-type"]) == (content, "image/png")
        assert picture.headers["x-content-type-options"] == "nosniff"
        assert "immutable" in picture.headers["cache-control"]
        assert served.client().get("/pictures/logo.png").status_code == 404


def test_forms_of_other_sites_are_not_used(served: Served) -> None:
    person = Participant(served)
    fields = {"step": "consent", "choice": "agree"}
    for headers in (
        {"origin": "https://evil.example"},
        {"sec-fetch-site": "cross-site", "origin": "null"},
        {"sec-fetch-site": "same-site"},
    ):
        assert person.http.post(person.path, data=fields, headers=headers).status_code == 403
        assert person.http.post("/s/mine/begin", headers=headers).status_code == 403
    person.load()
    assert person.stage == "consent"
    own = {"origin": "null", "sec-fetch-site": "same-origin"}
    assert 'data-stage="questionnaire"' in person.http.post(person.path, data=fields, headers=own).text


@pytest.mark.parametrize(
    "path", ["/s/mine", "/v/nobody", "/static/css/base.css", "/healthz", "/static/templates/base.html"]
)
def test_every_answer_keeps_other_sites_out(served: Served, path: str) -> None:
    http = served.client()
    headers = http.get(path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["x-frame-options"] == "DENY"
    assert "server" not in headers


def test_pages_are_never_cached_and_static_files_briefly(served: Served) -> None:
    http = served.client()
    assert http.get("/s/mine").headers["cache-control"] == "no-store"
    assert http.get("/static/js/play.js").headers["cache-control"] == "public, max-age=300"
    assert http.get("/static/templates/base.html").status_code == 404
    assert http.get("/static/../templates/base.html").status_code == 404


def test_health_says_whether_records_are_written(served: Served) -> None:
    http = served.client()
    answer = http.get("/healthz")
    assert answer.status_code == 200
    assert answer.json()["ok"] is True


def test_records_that_cannot_be_reached_are_told_politely(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    away: Future[None] = Future()
    away.set_exception(GalleyError("the records cannot be reached: no route to host"))
    person = Participant(served)
    monkeypatch.setattr(served.store, "read", lambda query: away)
    page = person.load()
    assert page.status_code == 503
    assert page.headers["retry-after"] == "5"
    assert "frame-ancestors 'none'" in page.headers["content-security-policy"]
    assert "no route" not in page.text
    assert "load this page again" in page.text
    monkeypatch.undo()
    assert person.load().status_code == 200
