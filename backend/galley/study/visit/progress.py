"""Progress through a visit: a pure state machine over the steps of its plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from galley.outcomes import ENDED_FROM_OUTSIDE, ROUND_OUTCOMES, VisitStatus
from galley.study.stages.stage_kinds import QuizStep
from galley.study.visit.happenings import (
    Declined,
    Ended,
    Happening,
    RoundEnded,
    Skipped,
    Submitted,
    TimedOut,
)
from galley.study.visit.plan import Plan
from galley.study.visit.steps import QuestionsStep, Step
from galley.study.written.item_base import Answer, is_right

Answers = Mapping[str, Mapping[str, Answer]]
"""All answers of a visit so far: by step, then by item."""


@dataclass(frozen=True)
class Progress:
    """Where a visit is: the index of its step, whether it goes on, failed tries at the step's quiz."""

    step_index: int = 0
    status: VisitStatus = "active"
    tries: int = 0


@dataclass(frozen=True)
class Refusal:
    """Why a happening changes nothing."""

    reason: str


def next_progress(
    plan: Plan, progress: Progress, happening: Happening, answers: Answers | None = None
) -> Progress | Refusal:
    """Where the visit is after `happening`: some steps on, over, or a refusal that changes nothing.

    `answers` are all those given so far, those of this step included. A happening names the step it belongs
    to, so the same one arriving twice, late or early is refused. Steps whose conditions the answers do not
    meet are passed over. A quiz with a wrong answer keeps the visit where it is, one try older, until the
    tries are used up. Reaching the debrief completes the visit.
    """
    answers = answers or {}
    if progress.status != "active":
        return Refusal(f"the visit is {progress.status}")
    step = plan.steps[progress.step_index]
    if happening.step_id != step.id:
        return Refusal(f"the visit is at step '{step.id}', not at '{happening.step_id}'")
    refused = _refused(step, happening)
    if refused is not None:
        return Refusal(refused)
    if isinstance(happening, Declined):
        return Progress(progress.step_index, "declined")
    if isinstance(happening, Ended):
        return Progress(progress.step_index, happening.outcome)
    if isinstance(happening, TimedOut) and step.at_limit == "end":
        return Progress(progress.step_index, "timed_out")
    if isinstance(happening, Submitted):
        if isinstance(step, QuizStep) and _wrong(step, answers):
            tries = progress.tries + 1
            if tries < step.tries:
                return Progress(progress.step_index, "active", tries)
            if step.after_last == "end":
                return Progress(progress.step_index, "failed_checks", tries)
        failed = failed_attention(plan, answers)
        if plan.attention.then == "end" and len(failed) > plan.attention.allowed:
            return Progress(progress.step_index, "failed_checks")
    return _onward(plan, progress.step_index + 1, answers)


def failed_attention(plan: Plan, answers: Answers) -> tuple[tuple[str, str], ...]:
    """(step, item) of every attention check that was failed; a quiz is none."""
    return tuple(
        (step.id, item)
        for step in plan.steps
        if isinstance(step, QuestionsStep) and not isinstance(step, QuizStep) and step.id in answers
        for item in _wrong(step, answers)
    )


def position(plan: Plan, progress: Progress, answers: Answers | None = None) -> tuple[int, int]:
    """(place, number) of the visit's step among those it meets, from 1; for a progress bar.

    Steps that depend on answers still to come count as met.
    """
    answers = answers or {}
    at = of = 0
    for index, step in enumerate(plan.steps):
        asked = {str(condition.item).partition(".")[0] for condition in step.when}
        decided = index < progress.step_index or asked <= answers.keys()
        passed_over = step.ends_visit_as == "screened_out" or (
            bool(step.when) and decided and not _met(step, answers)
        )
        if index == progress.step_index or not passed_over:
            of += 1
            at += index <= progress.step_index
    return at, of


def _onward(plan: Plan, index: int, answers: Answers) -> Progress:
    while not _met(plan.steps[index], answers):
        index += 1
    return Progress(index, plan.steps[index].ends_visit_as or "active")


def _met(step: Step, answers: Answers) -> bool:
    for condition in step.when:
        stage, _, item = str(condition.item).partition(".")
        if not condition.holds(answers.get(stage, {}).get(item)):
            return False
    return True


def _wrong(step: QuestionsStep, answers: Answers) -> tuple[str, ...]:
    """The items with a right answer that were answered otherwise; those not asked have no answer at all."""
    given = answers.get(step.id, {})
    return tuple(
        item
        for item, right in step.expected.items()
        if given.get(item) is not None and not is_right(right, given[item])
    )


def _refused(step: Step, happening: Happening) -> str | None:
    match happening:
        case Ended():
            if happening.outcome not in ENDED_FROM_OUTSIDE:
                return f"a visit does not end as '{happening.outcome}' by itself"
        case Skipped():
            if not step.skippable or RoundEnded in step.ended_by:  # a round ends as skipped
                return "this step may not be skipped"
        case TimedOut():
            if step.time_limit_s is None:
                return "this step has no time limit"
        case _:
            if not isinstance(happening, step.ended_by):
                return f"a {step.kind} step does not end by '{type(happening).__name__}'"
            if isinstance(happening, RoundEnded):
                if happening.outcome not in ROUND_OUTCOMES:
                    return f"a round does not end as '{happening.outcome}'"
                if happening.outcome == "skipped" and not step.skippable:
                    return "this round may not be skipped"
    return None
