"""The participant's pages: safe, complete and usable without scripts."""

from __future__ import annotations

import pytest

from tests.frontend.pages import FRONTEND, HOSTILE, QUESTIONNAIRE, Page, contexts, render

TEMPLATES = sorted(contexts())
VISIT_PAGES = [name for name in TEMPLATES if "step" in contexts()[name]]
FORMS = ["landing.html", "consent.html", "instructions.html", "questionnaire.html", "comparison.html"]


def test_every_template_is_rendered_here() -> None:
    files = {path.name for path in (FRONTEND / "templates").glob("*.html")}
    assert {name for name in files if not name.startswith("_")} - {"base.html"} == set(TEMPLATES)


@pytest.mark.parametrize("name", TEMPLATES)
def test_texts_of_a_study_are_escaped(name: str) -> None:
    html = render(name)
    assert HOSTILE not in html
    page = Page(html)
    assert not page.all("img", src="x")
    assert not [text for tag, text in page.texts if tag == "script" and text.strip()]


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
    assert all(attrs.get("src") for attrs in page.all("script"))


def _leaving(name: str) -> list[str]:
    return [contexts()[name]["redirect"]] if name == "debrief.html" else []


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


@pytest.mark.parametrize("name", [name for name in VISIT_PAGES if name != "round.html"])
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


@pytest.mark.parametrize("name", ["questionnaire.html", "comparison.html"])
def test_every_item_has_fields_of_its_name_and_nothing_is_chosen_beforehand(name: str) -> None:
    page = Page(render(name))
    fields = page.all("input") + page.all("textarea")
    assert {field["name"] for field in fields} == {"step", *(item.id for item in QUESTIONNAIRE.items)}
    assert not [field for field in fields if "checked" in field]
    assert len(page.all("input", name="radio")) == 7
    assert len(page.all("input", name="stars")) == 5
    assert [field["value"] for field in page.all("input", name="versus")] == list("1234567")
    assert len(page.all("fieldset")) == len(page.all("legend")) == len(QUESTIONNAIRE.items)
    assert page.all("fieldset", id="item-many")[0]["data-when"] == "one"


def test_values_are_kept_as_sent() -> None:
    values = {
        "radio": ["3"],
        "stars": ["9"],
        "one": ["b"],
        "many": ["a", "b"],
        "age": [HOSTILE],
        "lines": ["\nx"],
    }
    page = Page(render("questionnaire.html", values=values))
    chosen = [(field["name"], field["value"]) for field in page.all("input") if "checked" in field]
    assert chosen == [("radio", "3"), ("one", "b"), ("many", "a"), ("many", "b")]
    assert page.all("input", name="age")[0]["value"] == HOSTILE
    assert ("textarea", "\n\nx") in page.texts


def test_a_problem_stands_beside_its_item_and_is_tied_to_it() -> None:
    page = Page(render("questionnaire.html", problems={"radio": "Please choose.", "age": HOSTILE}))
    summary = page.all("div", id="problems")[0]
    assert summary["role"] == "alert"
    links = [link["href"] for link in page.all("a")]
    assert [link for link in links if link.startswith("#item")] == ["#item-radio", "#item-age"]
    assert page.all("p", id="error-radio")
    described = page.all("fieldset", id="item-radio")[0]["aria-describedby"]
    assert described.split() == ["help-radio", "error-radio"]
    assert {field["aria-invalid"] for field in page.all("input", name="radio")} == {"true"}
    assert not [field for field in page.all("input", name="stars") if "aria-invalid" in field]


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


def test_the_code_can_be_found_and_the_way_on_is_a_link() -> None:
    page = Page(render("debrief.html"))
    assert page.all("output", id="completion-code")
    assert page.all("a", href=contexts()["debrief.html"]["redirect"])
    assert not Page(render("debrief.html", completion_code=None, redirect=None)).all("output")
