"""What the page of each step is given: a step's contents in words, never its agents or right answers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from galley.outcomes import TurnedAway
from galley.server.participant.hand_in import hand_in
from galley.server.participant.visits import Visit
from galley.study.scores import wrong_items
from galley.study.stages.round_step import RoundStep
from galley.study.stages.stage_kinds import DebriefStep, QuizStep
from galley.study.study import Study
from galley.study.visit.steps import QuestionsStep, Step, TextStep
from galley.study.written.item_base import Answer
from galley.study.written.questionnaire import Questionnaire
from galley.study.written.recruitment import Ending


def public_study(study: Study) -> dict[str, Any]:
    """What templates may know of a study: no agents, no design."""
    minutes = {"minutes": study.minutes, "minutes_told": study.minutes_told}
    return {"name": study.name, "title": study.title, "about": study.about, **minutes}


def public_step(step: Step) -> dict[str, Any]:
    """What templates may know of a step: no agents, no seeds."""
    return {"id": step.id, "kind": step.kind, "title": step.title, **step.public()}


def questionnaire_of(visit: Visit) -> Questionnaire | None:
    """The questions that a visit's page asks, in its order; None for a page that asks nothing."""
    return visit.study.questionnaire_for(visit.step) if isinstance(visit.step, QuestionsStep) else None


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
        "away": f"{visit.url}/away" if visit.active and visit.round is None else None,
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
    step = visit.step
    context = step.public()
    if isinstance(step, TextStep):
        context["html"] = _html(visit, step.text)
    if isinstance(step, QuestionsStep):
        context |= {
            "questionnaire": questionnaire_of(visit),
            "values": values or {},
            "problems": problems or {},
        }
    match step:
        case QuizStep():
            context |= _quiz(visit, step, sent_back=bool(problems))
        case DebriefStep():
            end = visit.study.ending("completed", visit.row.link_params)
            context |= {"completion_code": end.code, "redirect": end.redirect}
            context["hand_in"] = hand_in(visit.row.link_params, end.code)
        case RoundStep():
            context |= {"socket": f"{visit.url}/play", "next": visit.url, "minutes": step.seconds / 60}
    return context


def ending_context(visit: Visit) -> dict[str, Any]:
    """What the last page of a visit that did not reach its debrief is given."""
    outcome = visit.progress.status
    if outcome == "active":
        raise ValueError("this visit has not ended")
    end = visit.study.ending(outcome, visit.row.link_params)
    handed = {"hand_in": hand_in(visit.row.link_params, end.code)}
    return _ending(visit.study, end, test=visit.row.test) | handed


def turned_away_context(study: Study, why: TurnedAway, params: Mapping[str, str]) -> dict[str, Any]:
    """What the page is given of somebody who cannot begin; a link without an id fills in none."""
    known = {} if why == "incomplete" else study.kept(params)
    return _ending(study, study.ending(why, known), test=False)


def _ending(study: Study, end: Ending, *, test: bool) -> dict[str, Any]:
    text = None if end.text is None else study.texts[end.text]
    return {
        "study": public_study(study),
        "language": study.language,
        "test": test,
        "outcome": end.outcome,
        "title": None if text is None else text.title,
        "html": None if text is None else text.html,
        "code": end.code,
        "redirect": end.redirect,
    }


def _html(visit: Visit, text: str | None) -> str | None:
    if isinstance(visit.step, DebriefStep) and text not in visit.study.texts:
        text = visit.study.ending("completed", {}).text
    return None if text is None else visit.study.texts[text].html


def _quiz(visit: Visit, step: QuizStep, *, sent_back: bool) -> dict[str, Any]:
    """What a quiz shows besides: after a failed try what was answered and which of it was wrong."""
    context: dict[str, Any] = {
        "tries_left": step.tries - visit.progress.tries,
        "html": _html(visit, step.text),
        "wrong": {},
    }
    if visit.attempt is not None and not sent_back:
        questionnaire = visit.study.questionnaire_for(step)
        context["wrong"] = wrong_items(questionnaire, visit.attempt.answers)
        context["values"] = as_sent(questionnaire, visit.attempt.answers)
    return context


def as_sent(questionnaire: Questionnaire, answers: Mapping[str, Answer]) -> dict[str, list[str]]:
    """Answers as the form fields that they came in."""
    sent: dict[str, list[str]] = {}
    for item in questionnaire.items:
        sent |= item.as_sent(answers.get(item.id))
    return sent
