"""Renders the participant's templates as the server does, with every kind of item and hostile texts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from galley.outcomes import VISIT_OUTCOMES
from galley.server.templates import translated_templates
from galley.study.written.questionnaire import Questionnaire
from tests.study.stages.kinds import KINDS

FRONTEND = Path(__file__).parents[2] / "frontend"
HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(1)>"
LEAVING = "https://example.org/?a=1&b=2"
FIRST_HAT, SECOND_HAT = "orange", "sky-blue"


def questionnaire(words: str = HOSTILE) -> Questionnaire:
    """One of each kind of item, every text of it the same words."""
    options = ({"value": "a", "label": words}, {"value": "b", "label": words})
    ends = {"text": words, "low_label": words, "high_label": words}
    plain = {"text": words, "required": False}
    items = (
        {"id": "radio", "kind": "likert", "help": words, **ends},
        {"id": "stars", "kind": "likert", "style": "stars", "scale": 5, **ends},
        {"id": "worded", "kind": "likert", "scale": 3, "labels": (words, words, words), **ends},
        {"id": "effort", "kind": "likert", "scale": 21, **ends},
        {"id": "percent", "kind": "likert", "scale": 31, **ends},
        {"id": "poles", "kind": "semantic_differential", "scale": 5, **ends},
        {"id": "versus", "kind": "comparison", **ends},
        {"id": "line", "kind": "slider", "unit": words, "show_value": True, **ends},
        {"id": "half", "kind": "slider", "min": 0, "max": 1, "step": 0.5, **ends},
        {"id": "ranks", "kind": "ranking", "text": words, "options": options},
        {"id": "one", "kind": "single_choice", "text": words, "options": options, "expected": "b"},
        {
            "id": "many",
            "kind": "multiple_choice",
            "text": words,
            "options": options,
            "when": {"item": "one", "any_of": ("a", "b")},
        },
        {"id": "age", "kind": "number", "min": 1, "max": 9, "unit": words, **plain},
        {"id": "name", "kind": "short_text", **plain},
        {"id": "story", "kind": "long_text", **plain},
    )
    return Questionnaire.model_validate(
        {"format": 1, "title": words, "source": "made for tests", "intro": words, "items": items}
    )


QUESTIONNAIRE = questionnaire()
SAID_ALOUD = (
    *("aria-label", "alt", "title", "placeholder"),
    *("data-title", "data-text", "data-you", "data-words"),
)
"""Attributes whose words participants read or hear."""

OUTCOMES = (*VISIT_OUTCOMES, "full", "later", "paused", "closed")


def contexts(words: str = HOSTILE) -> dict[str, dict[str, Any]]:
    """What each template is given, as the server gives it; the study says the same words everywhere."""
    study = {"name": "demo", "title": words, "about": words, "minutes": 12}
    clock = {"seconds_left": 250, "wait_s": 40, "early": True, "skippable": True, "test": True}

    def visit(kind: str, **more: Any) -> dict[str, Any]:
        hats = {"partner_hat": FIRST_HAT, "human_hat": "blue"}
        more["away"] = "/v/token/away"
        step = {"id": f"{kind}-1", "kind": kind, "title": words, "round_no": 1, **hats}
        return {"step": step, "study": study, "progress": {"at": 2, "of": 9}, "action": "/v/token", **more}

    asked = {"questionnaire": questionnaire(words), "values": {}, "problems": {}}
    offered = [{"code": "en", "name": words, "url": "/s/demo?language=en"}]
    round_page = {
        "socket": "/v/token/play",
        "next": "/v/token",
        "minutes": 1.0,
        "round_no": 1,
        "of": 6,
        "goal": {"score": 160, "text": words},
        "bonus": {"amount": 0.5, "unit": words},
        "human_hat": "blue",
        "partner_hat": FIRST_HAT,
        "tutorial": False,
        "skippable": True,
    }
    end = {"html": "<p>1</p>", "completion_code": words, "redirect": LEAVING}
    every_kind = {
        f"{kind.step}.html": visit(kind.step, html="<p>1</p>", **(_in_words(kind.page, words) | clock))
        for kind in KINDS.values()
        if kind.step != "screen_out"
    }
    return every_kind | {
        "landing.html": {
            "study": study,
            "minutes": 12,
            "action": "/s/demo/begin",
            "language": "en",
            "languages": [*offered, {"code": "zh", "name": words, "url": "/s/demo?language=zh"}],
        },
        "studies.html": {"studies": [study], "query": ""},
        "plain.html": {"title": words, "message": words, "status": 404},
        "ending.html": {"study": study, "outcome": "declined", "code": words, "redirect": LEAVING},
        "consent.html": visit("consent", html="<p>1</p>"),
        "instructions.html": visit("instructions", html="<p>1</p>", **clock),
        "break.html": visit("break", **clock),
        "questionnaire.html": visit("questionnaire", **asked, **clock),
        "quiz.html": visit("quiz", **asked, wrong={"one": words}, tries_left=2, html="<p>1</p>"),
        "comparison.html": visit(
            "comparison", **asked, first={"hat": FIRST_HAT}, second={"hat": SECOND_HAT}, human_hat="blue"
        ),
        "lobby.html": visit(
            "round", seconds_left=70, waited_s=50, poll="/v/token/lobby", human_hat="blue", fallback="exit"
        ),
        "round.html": visit("round", **round_page),
        "debrief.html": visit("debrief", **end),
    }


def variants() -> Iterator[tuple[str, str, dict[str, Any]]]:
    """(name, template, context) of every page as it may look; the study says `1` everywhere."""
    for name, values in contexts("1").items():
        yield name, name, values
    for outcome in OUTCOMES:
        yield f"ending.html {outcome}", "ending.html", contexts("1")["ending.html"] | {"outcome": outcome}
    base = contexts("1")
    for fallback in ("go_on", "agent"):
        yield f"lobby {fallback}", "lobby.html", base["lobby.html"] | {"fallback": fallback}
    for partner in ("none", "human"):
        more = {"partner": partner, "input_mode": "press", "round_no": 0, "episodes": 2}
        yield f"round {partner}", "round.html", base["round.html"] | more
    answered = {"problems": {"age": "1", "one": "1"}, "early": False}
    yield "questionnaire problems", "questionnaire.html", base["questionnaire.html"] | answered
    yield "quiz fresh", "quiz.html", base["quiz.html"] | {"wrong": {}, "tries_left": 1}
    yield "studies none", "studies.html", {"studies": [], "query": ""}


def _in_words(page: Mapping[str, Any], words: str) -> dict[str, Any]:
    """What a page of its own kind is given, all words of it the same; hats and addresses are no words."""
    return {
        key: words
        if isinstance(value, str) and not key.endswith("hat") and not value.startswith("https://")
        else value
        for key, value in page.items()
    }


def render(name: str, words: str = HOSTILE, **changes: Any) -> str:
    """A template with its context, some of it changed."""
    return (
        translated_templates(str(FRONTEND / "templates"))
        .get_template(name)
        .render(**(contexts(words)[name] | changes))
    )


VOID = ("meta", "link", "img", "input", "br", "hr", "path")


class Page(HTMLParser):
    """The start tags of a page with their attributes, and the text of one kind of tag."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.texts: list[tuple[str, str]] = []
        self._open: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag in self._open:
            while self._open.pop() != tag:
                pass

    def handle_data(self, data: str) -> None:
        if self._open:
            self.texts.append((self._open[-1], data))

    @property
    def scripts(self) -> list[str]:
        """Files of the scripts that run; blocks of data do not."""
        blocks = [attrs for attrs in self.all("script") if attrs.get("type") != "application/json"]
        return [attrs["src"].removeprefix("/static/") for attrs in blocks]

    def all(self, tag: str, **wanted: str) -> list[dict[str, str]]:
        """The attributes of every such tag that has the wanted values."""
        found = [attrs for name, attrs in self.tags if name == tag]
        return [attrs for attrs in found if all(attrs.get(name) == value for name, value in wanted.items())]
