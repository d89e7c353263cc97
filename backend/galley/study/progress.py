"""Progress through a visit: a pure state machine over the steps of its plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

from galley.study.plan import Plan, StepKind

Status = Literal["active", "completed", "declined"]
Outcome = Literal["finished", "abandoned", "skipped"]
OUTCOMES: Final[tuple[Outcome, ...]] = get_args(Outcome)


@dataclass(frozen=True)
class Progress:
    """Where a visit is: the index of its step, and whether it goes on."""

    step_index: int = 0
    status: Status = "active"


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
    """The participant has read a text and goes on."""

    step_id: str


@dataclass(frozen=True)
class RoundEnded:
    """A round is over: played to its end, left for too long, or (where allowed) skipped."""

    step_id: str
    outcome: Outcome


Happening = Agreed | Declined | Submitted | Continued | RoundEnded

_FITS: Final[dict[StepKind, tuple[type[Happening], ...]]] = {
    "consent": (Agreed, Declined),
    "questionnaire": (Submitted,),
    "instructions": (Continued,),
    "round": (RoundEnded,),
    "comparison": (Submitted,),
    "debrief": (),
}


@dataclass(frozen=True)
class Refusal:
    """Why a happening changes nothing."""

    reason: str


def next_progress(plan: Plan, progress: Progress, happening: Happening) -> Progress | Refusal:
    """Where the visit is after `happening`: one step on, or a refusal that changes nothing.

    A happening names the step it belongs to, so the same one arriving twice, late or early is refused. Only
    declining ends a visit before the last step; reaching the last step, the debrief, completes it.
    """
    if progress.status != "active":
        return Refusal(f"the visit is {progress.status}")
    step = plan.steps[progress.step_index]
    if happening.step_id != step.id:
        return Refusal(f"the visit is at step '{step.id}', not at '{happening.step_id}'")
    if not isinstance(happening, _FITS[step.kind]):
        return Refusal(f"a {step.kind} step does not end by '{type(happening).__name__}'")
    if isinstance(happening, RoundEnded):
        if happening.outcome not in OUTCOMES:
            return Refusal(f"a round does not end as '{happening.outcome}'")
        if happening.outcome == "skipped" and not step.data["skippable"]:
            return Refusal("this round may not be skipped")
    if isinstance(happening, Declined):
        return Progress(progress.step_index, "declined")
    following = progress.step_index + 1
    return Progress(following, "completed" if following == len(plan.steps) - 1 else "active")
