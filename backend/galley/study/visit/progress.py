"""Progress through a visit: a pure state machine over the steps of its plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, get_args

from galley.study.visit.steps import Plan, Step, StepKind
from galley.study.written.item_base import Answer, is_right
from galley.study.written.recruitment import Outcome as VisitOutcome

Status = Literal["active"] | VisitOutcome
Outcome = Literal["finished", "abandoned", "skipped"]
OUTCOMES: Final[tuple[Outcome, ...]] = get_args(Outcome)
"""How a round may end; how a visit may end stands in `recruitment`."""

ENDED_FROM_OUTSIDE: Final[tuple[VisitOutcome, ...]] = ("timed_out", "expired", "partner_missing")

Answers = Mapping[str, Mapping[str, Answer]]
"""All answers of a visit so far: by step, then by item."""


@dataclass(frozen=True)
class Progress:
    """Where a visit is: the index of its step, whether it goes on, failed tries at the step's quiz."""

    step_index: int = 0
    status: Status = "active"
    tries: int = 0


@dataclass(frozen=True)
class Agreed:
    """The participant agreed to the consent text."""

    step_id: str


@dataclass(frozen=True)
class Declined:
    """The participant declined; the visit ends."""

    step_id: str


@dataclass(frozen=True)
class Submitted:
    """Answers without a problem arrived (`validate_answers` comes before)."""

    step_id: str


@dataclass(frozen=True)
class Continued:
    """The participant has read a text or rested and goes on."""

    step_id: str


@dataclass(frozen=True)
class Skipped:
    """The participant leaves out a step that may be left out."""

    step_id: str


@dataclass(frozen=True)
class TimedOut:
    """The step's time limit has passed."""

    step_id: str


@dataclass(frozen=True)
class RoundEnded:
    """A round is over: played to its end, left for too long, or (where allowed) skipped."""

    step_id: str
    outcome: Outcome


@dataclass(frozen=True)
class Ended:
    """The visit ends for a reason outside its steps: too long in all, slot given away, partner missing."""

    step_id: str
    outcome: VisitOutcome


Happening = Agreed | Declined | Submitted | Continued | Skipped | TimedOut | RoundEnded | Ended

_FITS: Final[dict[StepKind, tuple[type[Happening], ...]]] = {
    "consent": (Agreed, Declined),
    "questionnaire": (Submitted,),
    "instructions": (Continued,),
    "quiz": (Submitted,),
    "break": (Continued,),
    "screen_out": (),
    "round": (RoundEnded,),
    "comparison": (Submitted,),
    "debrief": (),
}


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
        if step.kind == "quiz" and _wrong(step, answers):
            tries = progress.tries + 1
            if tries < step.data["tries"]:
                return Progress(progress.step_index, "active", tries)
            if step.data["after_last"] == "end":
                return Progress(progress.step_index, "failed_checks", tries)
        failed = failed_attention(plan, answers)
        if plan.attention["then"] == "end" and len(failed) > plan.attention["allowed"]:
            return Progress(progress.step_index, "failed_checks")
    return _onward(plan, progress.step_index + 1, answers)


def failed_attention(plan: Plan, answers: Answers) -> tuple[tuple[str, str], ...]:
    """(step, item) of every attention check that was failed; a quiz is none."""
    return tuple(
        (step.id, item)
        for step in plan.steps
        if step.kind != "quiz" and step.id in answers
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
        passed_over = step.kind == "screen_out" or (bool(step.when) and decided and not _met(step, answers))
        if index == progress.step_index or not passed_over:
            of += 1
            at += index <= progress.step_index
    return at, of


def _onward(plan: Plan, index: int, answers: Answers) -> Progress:
    while not _met(plan.steps[index], answers):
        index += 1
    match plan.steps[index].kind:
        case "debrief":
            return Progress(index, "completed")
        case "screen_out":
            return Progress(index, "screened_out")
        case _:
            return Progress(index)


def _met(step: Step, answers: Answers) -> bool:
    for condition in step.when:
        stage, _, item = str(condition.item).partition(".")
        if not condition.holds(answers.get(stage, {}).get(item)):
            return False
    return True


def _wrong(step: Step, answers: Answers) -> tuple[str, ...]:
    """The items with a right answer that were answered otherwise; those not asked have no answer at all."""
    given = answers.get(step.id, {})
    expected = step.data.get("expected", {})
    return tuple(
        item
        for item, right in expected.items()
        if given.get(item) is not None and not is_right(right, given[item])
    )


def _refused(step: Step, happening: Happening) -> str | None:
    match happening:
        case Ended():
            if happening.outcome not in ENDED_FROM_OUTSIDE:
                return f"a visit does not end as '{happening.outcome}' by itself"
        case Skipped():
            if not step.skippable or step.kind in ("consent", "round", "debrief"):
                return "this step may not be skipped"
        case TimedOut():
            if step.time_limit_s is None:
                return "this step has no time limit"
        case _:
            if not isinstance(happening, _FITS[step.kind]):
                return f"a {step.kind} step does not end by '{type(happening).__name__}'"
            if isinstance(happening, RoundEnded):
                if happening.outcome not in OUTCOMES:
                    return f"a round does not end as '{happening.outcome}'"
                if happening.outcome == "skipped" and not step.skippable:
                    return "this round may not be skipped"
    return None
