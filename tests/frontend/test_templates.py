"""The participant's pages: safe, complete and usable without scripts."""

from __future__ import annotations

import json
import re

import pytest

from tests.frontend.pages import (
    FRONTEND,
    HOSTILE,
    LEAVING,
    OUTCOMES,
    QUESTIONNAIRE,
    Page,
    contexts,
    render,
)

TEMPLATES = sorted(contexts())
VISIT_PAGES = [name for name in TEMPLATES if "step" in contexts()[name]]
QUESTIONS = ["questionnaire.html", "quiz.html", "comparison.html"]
FORMS = ["landing.html", "consent.html", "instructions.html", "break.html", "lobby.html", *QUESTIONS]


def test_every_template_is_rendered_here() -> None:
    files = {path.name for path in (FRONTEND / "templates").glob("*.html")}
    assert {name for name in files if not name.startswith("_")} - {"base.html"} == set(TEMPLATES)


@pytest.mark.parametrize("name", TEMPLATES)
def test_texts_of_a_study_are_escaped(name: str) -> None:
    html = render(name)
    assert HOSTILE not in html
    page = Page(html)
    assert not page.all("img", src="x")
    words = [json.loads(text) for tag, text in page.texts if tag == "script" and text.strip()]
    assert bool(words) == (name == "round.html")


@pytest.mark.parametrize("name", TEMPLATES)
def test_nothing_inline_and_no_other_host(name: str) -> None:
    page = Page(render(name))
    for tag, attrs in page.tags:
        assert tag != "style"
        assert "style" not in attrs
        assert not [key for key in attrs if key.startswith("on")]
        for key in ("src", "href", "action", "data-socket", "data-next"):
            place = attrs.get(key, "")
            here = place.startswith(("/", "#")) and not place.startswith("//")
            assert here or place in ("", *_leaving(name)), place
    assert all(script.startswith("js/") for script in page.scripts)


def _leaving(name: str) -> list[str]:
    """The addresses elsewhere that the study itself sends people to."""
    return [value for value in contexts()[name].values() if str(value).startswith("https://")]


@pytest.mark.parametrize("name", TEMPLATES)
def test_files_that_a_page_asks_for_are_there(name: str) -> None:
    page = Page(render(name))
    places = [attrs[key] for _, attrs in page.tags for key in ("src", "href") if key in attrs]
    files = [place.removeprefix("/static/") for place in places if place.startswith("/static/")]
    assert files
    assert [file for file in files if not (FRONTEND / file).is_file()] == []


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_page_has_one_heading_a_language_and_a_stage(name: str) -> None:
    page = Page(render(name))
    assert len(page.all("h1")) == 1
    assert len(page.all("main")) == 1
    assert page.all("html", lang="en")
    wanted = name.removesuffix(".html") if name != "studies.html" else "plain"
    assert page.all("body")[0]["data-stage"] == wanted


@pytest.mark.parametrize(
    "name", [name for name in VISIT_PAGES if name != "round.html" and "progress" in contexts()[name]]
)
def test_progress_stands_at_the_top(name: str) -> None:
    bar = Page(render(name)).all("progress")[0]
    assert (bar["value"], bar["max"]) == ("2", "9")


@pytest.mark.parametrize("name", FORMS)
def test_forms_post_their_step_and_end_in_a_button(name: str) -> None:
    page = Page(render(name))
    (form,) = page.all("form")
    assert form["method"] == "post"
    assert form["action"] == contexts()[name]["action"]
    assert page.all("button", type="submit")
    if "step" in contexts()[name]:
        assert page.all("input", type="hidden", name="step")[0]["value"] == contexts()[name]["step"]["id"]


def test_consent_can_be_given_or_refused() -> None:
    choices = [button["value"] for button in Page(render("consent.html")).all("button", name="choice")]
    assert choices == ["agree", "decline"]


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_item_has_fields_of_its_name_and_nothing_is_chosen_beforehand(name: str) -> None:
    page = Page(render(name))
    fields = page.all("input") + page.all("textarea") + page.all("select")
    places = {"ranks.a", "ranks.b"}
    assert {field["name"] for field in fields} == {"step", *(item.id for item in QUESTIONNAIRE.items)} - {
        "ranks"
    } | places
    assert not page.all("option", selected="")
    assert page.all("input", name="line")[0]["value"] == ""
    assert not [field for field in fields if "checked" in field]
    assert len(page.all("input", name="radio")) == 7
    assert len(page.all("input", name="stars")) == 5
    assert [field["value"] for field in page.all("input", name="versus")] == list("1234567")
    assert len(page.all("input", name="effort")) == 21
    assert len(page.all("fieldset")) == len(page.all("legend")) == len(QUESTIONNAIRE.items)
    assert page.all("fieldset", id="item-many")[0]["data-when"] == "one"


def test_values_are_kept_as_sent() -> None:
    values = {
        "radio": ["3"],
        "stars": ["9"],
        "one": ["b"],
        "many": ["a", "b"],
        "age": [HOSTILE],
        "story": ["\nx"],
        "line": ["70"],
        "ranks.a": ["2"],
        "ranks.b": ["1"],
    }
    page = Page(render("questionnaire.html", values=values))
    chosen = [(field["name"], field["value"]) for field in page.all("input") if "checked" in field]
    assert chosen == [("radio", "3"), ("one", "b"), ("many", "a"), ("many", "b")]
    assert page.all("input", name="age")[0]["value"] == HOSTILE
    assert page.all("input", name="line")[0]["value"] == "70"
    assert len(page.all("option", selected="")) == 2
    assert ("textarea", "\n\nx") in page.texts


def test_a_problem_stands_beside_its_item_and_is_tied_to_it() -> None:
    page = Page(render("questionnaire.html", problems={"radio": "Please choose.", "age": HOSTILE}))
    summary = page.all("div", id="problems")[0]
    assert summary["role"] == "alert"
    links = [link["href"] for link in page.all("a")]
    assert [link for link in links if link.startswith("#item")] == ["#item-radio", "#item-age"]
    assert page.all("p", id="error-radio")
    group = page.all("fieldset", id="item-radio")[0]
    assert group["aria-describedby"].split() == ["help-radio", "error-radio"]
    assert (group["role"], group["aria-invalid"]) == ("radiogroup", "true")
    assert page.all("input", name="age")[0]["aria-invalid"] == "true"
    assert "aria-invalid" not in page.all("fieldset", id="item-stars")[0]


def test_a_quiz_marks_what_was_wrong_with_its_hint_and_keeps_the_rest() -> None:
    html = render("quiz.html", wrong={"one": "Look at the pot.", "radio": ""}, values={"one": ["a"]})
    page = Page(html)
    assert [link["href"] for link in page.all("a") if "#item" in link["href"]] == ["#item-radio", "#item-one"]
    assert "2 answers were not right." in html
    assert "You have 2 more tries." in html
    assert "This is not right yet. Look at the pot." in html
    assert [field["name"] for field in page.all("input") if "checked" in field] == ["one"]
    fresh = render("quiz.html", wrong={}, tries_left=1)
    assert "You have 1 try." in fresh
    assert not Page(fresh).all("div", id="problems")


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_every_outcome_has_its_own_words_and_may_have_a_code_and_a_way_out(outcome: str) -> None:
    page = Page(render("ending.html", outcome=outcome, code="ABC", redirect=None))
    title = [text for tag, text in page.texts if tag == "h1"]
    assert title[0].strip()
    assert [text for tag, text in page.texts if tag == "output"] == ["ABC"]
    assert not page.all("a", href=LEAVING)
    own = Page(render("ending.html", outcome=outcome, html="<p>Own</p>", title="Own title", code=None))
    assert ("h1", "Own title") in own.texts
    assert ("p", "Own") in own.texts
    assert not own.all("output")
    assert own.all("a", href=LEAVING)


def test_time_is_told_without_scripts_and_kept_by_them() -> None:
    page = Page(render("break.html", early=False))
    assert page.all("p", id="wait")
    assert page.all("button", type="submit")[0]["data-wait"] == "40"
    assert page.all("p")[1]["data-left"] == "250"
    assert "You have about 5 minutes for this page." in "".join(text for _, text in page.texts)
    assert page.scripts == ["js/clock.js", "js/away.js"]
    assert not Page(render("break.html", wait_s=0, seconds_left=None, away=None)).scripts


def test_a_stage_may_be_skipped_only_if_it_says_so() -> None:
    assert Page(render("questionnaire.html")).all("button", name="skip")
    assert not Page(render("questionnaire.html", skippable=False)).all("button", name="skip")


def test_the_language_can_be_chosen_where_there_are_several() -> None:
    page = Page(render("landing.html"))
    assert [link["hreflang"] for link in page.all("a") if "hreflang" in link] == ["en", "zh"]
    assert page.all("input", name="language")[0]["value"] == "en"
    assert not Page(render("landing.html", languages=contexts()["landing.html"]["languages"][:1])).all("nav")


def test_pages_speak_the_language_of_the_visit() -> None:
    page = Page(render("consent.html", language="zh-CN"))
    assert page.all("html", lang="zh-CN")
    assert ("button", "I agree and want to take part") not in page.texts
    assert ("button", "I agree and want to take part") in Page(render("consent.html", language="xx")).texts


def test_the_lobby_is_asked_anew_without_scripts_and_can_be_left() -> None:
    page = Page(render("lobby.html"))
    assert page.all("meta", content="5")
    assert page.all("button", name="leave")
    assert page.all("div", **{"data-poll": "/v/token/lobby"})


def test_partners_are_known_by_hat_picture_and_word() -> None:
    html = render("comparison.html")
    sources = [image["src"] for image in Page(html).all("img")]
    assert [sources.count(f"/static/sprites/hat-{hat}.svg") for hat in ("orange", "sky-blue")] == [2, 2]
    assert "Orange hat" in html
    assert "Light blue hat" in html


def test_a_round_without_goal_hats_or_skip() -> None:
    html = render("round.html", goal=None, human_hat=None, partner_hat=None, skippable=False, round_no=0)
    page = Page(html)
    assert not page.all("form")
    assert not page.all("img")
    assert page.all("main", id="kitchen")[0]["data-socket"] == "/v/token/play"
    assert page.all("canvas")[0]["aria-label"]
    assert page.all("noscript")


def test_a_round_with_nobody_or_with_a_participant_says_so() -> None:
    assert "You cook alone" in render("round.html", partner="none")
    assert len(Page(render("round.html", partner="none")).all("img")) == 2
    assert "Another participant wears" in render("round.html", partner="human")


@pytest.mark.parametrize("shown", ["after", "never"])
def test_a_score_that_is_not_shown_in_play_has_no_place(shown: str) -> None:
    html = render("round.html", show_score=shown)
    assert 'data-part="score"' not in html
    assert 'data-part="goal-bar"' not in html


def test_words_for_the_script_are_those_it_asks_for() -> None:
    (block,) = [text for tag, text in Page(render("round.html")).texts if tag == "script" and text.strip()]
    asked = set()
    for name in ("play.js", "hud.js"):
        asked |= set(re.findall(r'say\("(\w+)"', (FRONTEND / "js" / name).read_text(encoding="utf-8")))
    assert asked == set(json.loads(block))


def test_the_code_can_be_found_and_the_way_on_is_a_link() -> None:
    page = Page(render("debrief.html"))
    assert page.all("output", id="completion-code")
    assert page.all("a", href=contexts()["debrief.html"]["redirect"])
    assert not Page(render("debrief.html", completion_code=None, redirect=None)).all("output")


def test_d1_the_landing_page_tells_the_least_and_the_most_minutes() -> None:
    assert "<strong>12\u201326 minutes</strong>" in render(
        "landing.html", minutes=26, minutes_told="12\u201326"
    )
    assert "<strong>1 minute</strong>" in render("landing.html", minutes=1, minutes_told="1")
    assert "<strong>12 minutes</strong>" in render("landing.html")
