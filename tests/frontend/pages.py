"""Renders the participant's templates as the server does, with every kind of item and hostile texts."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from galley.server.pages import templates
from galley.study.questionnaire import Questionnaire

FRONTEND = Path(__file__).parents[2] / "frontend"
HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(1)>"
FIRST_HAT, SECOND_HAT = "orange", "sky-blue"


def _scale(kind: str, item_id: str, **more: Any) -> dict[str, Any]:
    ends = {"low_label": f"low {HOSTILE}", "high_label": "high"}
    return {"id": item_id, "kind": kind, "text": f"{item_id} {HOSTILE}", **ends, **more}


OPTIONS = [{"value": "a", "label": HOSTILE}, {"value": "b", "label": "B"}]
QUESTIONNAIRE = Questionnaire.model_validate(
    {
        "format": 1,
        "title": HOSTILE,
        "source": "made for tests",
        "intro": HOSTILE,
        "items": (
            _scale("likert", "radio", help=HOSTILE),
            _scale("likert", "stars", style="stars", scale=5),
            _scale("likert", "worded", scale=3, labels=("no", HOSTILE, "yes")),
            _scale("comparison", "versus"),
            {"id": "one", "kind": "single_choice", "text": "One", "options": tuple(OPTIONS)},
            {
                "id": "many",
                "kind": "multiple_choice",
                "text": "Many",
                "options": tuple(OPTIONS),
                "when": {"item": "one", "any_of": ("a", "b")},
            },
            {
                "id": "age",
                "kind": "number",
                "text": "Age",
                "min": 1,
                "max": 9,
                "unit": HOSTILE,
                "required": False,
            },
            {"id": "line", "kind": "short_text", "text": "Line", "required": False},
            {"id": "lines", "kind": "long_text", "text": "Lines", "required": False},
        ),
    }
)


def contexts() -> dict[str, dict[str, Any]]:
    """What each template is given, as `galley.server.pages` gives it."""
    study = {"name": "demo", "title": HOSTILE, "about": HOSTILE, "minutes": 12}

    def visit(kind: str, **more: Any) -> dict[str, Any]:
        hats = {"partner_hat": FIRST_HAT, "human_hat": "blue"}
        step = {"id": f"{kind}-1", "kind": kind, "title": HOSTILE, "round_no": 1, **hats}
        return {"step": step, "study": study, "progress": {"at": 2, "of": 9}, "action": "/v/token", **more}

    asked = {"questionnaire": QUESTIONNAIRE, "values": {}, "problems": {}}
    round_page = {
        "socket": "/v/token/play",
        "next": "/v/token",
        "minutes": 1.0,
        "round_no": 1,
        "of": 6,
        "goal": {"score": 160, "text": HOSTILE},
        "human_hat": "blue",
        "partner_hat": FIRST_HAT,
        "tutorial": False,
        "skippable": True,
    }
    end = {"html": "<p>End</p>", "completion_code": HOSTILE, "redirect": "https://example.org/?a=1&b=2"}
    return {
        "landing.html": {"study": study, "minutes": 12, "action": "/s/demo/begin"},
        "studies.html": {"studies": [study]},
        "plain.html": {"title": HOSTILE, "message": HOSTILE, "status": 404},
        "consent.html": visit("consent", html="<p>Agree?</p>"),
        "instructions.html": visit("instructions", html="<p>Cook.</p>"),
        "questionnaire.html": visit("questionnaire", **asked),
        "comparison.html": visit(
            "comparison", **asked, first={"hat": FIRST_HAT}, second={"hat": SECOND_HAT}, human_hat="blue"
        ),
        "round.html": visit("round", **round_page),
        "debrief.html": visit("debrief", **end),
    }


def render(name: str, **changes: Any) -> str:
    """A template with its context, some of it changed."""
    return templates(str(FRONTEND / "templates")).get_template(name).render(**(contexts()[name] | changes))


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
        self._open.append(tag)

    def handle_data(self, data: str) -> None:
        if self._open:
            self.texts.append((self._open[-1], data))

    def all(self, tag: str, **wanted: str) -> list[dict[str, str]]:
        """The attributes of every such tag that has the wanted values."""
        found = [attrs for name, attrs in self.tags if name == tag]
        return [attrs for attrs in found if all(attrs.get(name) == value for name, value in wanted.items())]
