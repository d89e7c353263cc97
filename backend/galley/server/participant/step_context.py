"""What the page of each step is given: a step's contents in words, never its agents or right answers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from galley.server.participant.visits import Visit
from galley.study.scores import wrong_items
from galley.study.study import Study
from galley.study.visit.plan import Step
from galley.study.written.item_base import Answer
from galley.study.written.questionnaire import Questionnaire

QUESTION_PAGES = ("questionnaire", "comparison", "quiz")
ROUND_WORDS = (
    *("round_no", "of", "goal", "bonus", "human_hat", "partner_hat", "tutorial", "skippable"),
    *("partner", "episodes", "show_score", "input_mode"),
)
"""What of a round's settings its page may know."""


def public_study(study: Study) -> dict[str, Any]:
    """What templates may know of a study: no agents, no design."""
    return {"name": study.name, "title": study.title, "about": study.about, "minutes": study.minutes}


def public_step(step: Step) -> dict[str, Any]:
    """What templates may know of a step: no agents, no seeds."""
    about = {name: step.data.get(name) for name in ("round_no", "partner_hat", "human_hat")}
    return {"id": step.id, "kind": step.kind, "title": step.title, **about}


def public_fallback(step: Step) -> str:
    """What follows when nobody comes to play, without the name of the agent that it may be."""
    fallback: str = step.data["lobby"]["fallback"]
    return fallback if fallback in ("exit", "go_on") else "agent"


def questionnaire_of(visit: Visit) -> Questionnaire | None:
    """The questions that a visit's page asks, in its order; None for a page that asks nothing."""
    return visit.study.questionnaire_for(visit.step) if visit.step.kind in QUESTION_PAGES else None


def common_context(visit: Visit, now_ms: float) -> dict[str, Any]:
    """What every page of a visit is given."""
    at, of = visit.position
    left_s = visit.seconds_left(now_ms)
    whole_s = visit.visit_seconds_left(now_ms) if visit.active else None
    return {
        "step": public_step(visit.step),
        "study": public_study(visit.study),
        "progress": {"at": at, "of": of},
        "action": visit.url,
        "language": visit.row.language,
        "test": visit.row.test,
        "seconds_left": None if left_s is None else max(0, math.ceil(left_s)),
        "away": f"{visit.url}/away" if visit.active and visit.step.kind != "round" else None,
        "visit_seconds_left": None if whole_s is None else max(0, math.ceil(whole_s)),
        "wait_s": math.ceil(visit.wait_s(now_ms)),
        "skippable": visit.step.skippable,
    }


def step_context(
    visit: Visit,
    values: Mapping[str, Sequence[str]] | None = None,
    problems: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """What the page of a visit's step is given besides; `values` and `problems` are of a form sent back."""
    step, data = visit.step, visit.step.data
    match step.kind:
        case "consent" | "instructions" | "break":
            return {"html": _html(visit, data["text"])}
        case "debrief":
            end = visit.study.ending("completed", visit.row.link_params)
            return {
                "html": _html(visit, data["text"]),
                "completion_code": end.code,
                "redirect": end.redirect,
            }
        case "questionnaire":
            return _asked(visit, values, problems)
        case "comparison":
            hats = {name: {"hat": data[name]["hat"]} for name in ("first", "second")}
            return {**_asked(visit, values, problems), **hats, "human_hat": data["human_hat"]}
        case "quiz":
            return _quiz(visit, values, problems)
        case _:
            return {
                **{name: data.get(name) for name in ROUND_WORDS},
                "socket": f"{visit.url}/play",
                "next": visit.url,
                "minutes": data["episodes"] * data["ticks"] * data["tick_ms"] / 60_000,
            }


def ending_context(visit: Visit) -> dict[str, Any]:
    """What the last page of a visit that did not reach its debrief is given."""
    outcome = visit.progress.status
    if outcome == "active":
        raise ValueError("this visit has not ended")
    end = visit.study.ending(outcome, visit.row.link_params)
    text = None if end.text is None else visit.study.texts[end.text]
    return {
        "study": public_study(visit.study),
        "language": visit.row.language,
        "test": visit.row.test,
        "outcome": outcome,
        "title": None if text is None else text.title,
        "html": None if text is None else text.html,
        "code": end.code,
        "redirect": end.redirect,
    }


def _html(visit: Visit, text: str | None) -> str | None:
    return None if text is None else visit.study.texts[text].html


def _asked(
    visit: Visit, values: Mapping[str, Sequence[str]] | None, problems: Mapping[str, str] | None
) -> dict[str, Any]:
    return {"questionnaire": questionnaire_of(visit), "values": values or {}, "problems": problems or {}}


def _quiz(
    visit: Visit, values: Mapping[str, Sequence[str]] | None, problems: Mapping[str, str] | None
) -> dict[str, Any]:
    """A quiz; after a failed try it shows what was answered and which of it was wrong."""
    data = visit.step.data
    questionnaire = visit.study.questionnaire_for(visit.step)
    wrong: Mapping[str, str] = {}
    if visit.attempt is not None and not problems:
        wrong = wrong_items(questionnaire, visit.attempt.answers)
        values = as_sent(questionnaire, visit.attempt.answers)
    return {
        "questionnaire": questionnaire,
        "values": values or {},
        "problems": problems or {},
        "wrong": wrong,
        "tries_left": data["tries"] - visit.progress.tries,
        "html": _html(visit, data["text"]),
    }


def as_sent(questionnaire: Questionnaire, answers: Mapping[str, Answer]) -> dict[str, list[str]]:
    """Answers as the form fields that they came in."""
    sent: dict[str, list[str]] = {}
    for item in questionnaire.items:
        sent |= item.as_sent(answers.get(item.id))
    return sent
