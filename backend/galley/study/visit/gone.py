"""What the steps of a stored plan name that is not there any more."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from galley.study.stages.round_step import RoundStep
from galley.study.stages.stage_kinds import DebriefStep
from galley.study.study import Study
from galley.study.visit.steps import QuestionsStep, Step

Has = Callable[[str, str], bool]
"""Whether there is such a thing: its kind, `layout` or `agent`, and its name."""


def gone(study: Study, step: Step, has: Has) -> tuple[str, ...]:
    """What the page of a step cannot do without and is gone, each as its kind and name.

    The debrief is not among them: a visit whose own is gone gets the one that the study has now.
    """
    return tuple(f"{kind} {name}" for kind, name in _needed(step) if not _there(study, kind, name, has))


def items_gone(study: Study, step: Step) -> tuple[str, ...]:
    """The items of a step's questionnaire that are gone: its page leaves them out."""
    if not isinstance(step, QuestionsStep) or step.questionnaire not in study.questionnaires:
        return ()
    here = {item.id for item in study.questionnaires[step.questionnaire].items}
    return tuple(
        f"item {step.questionnaire}.{name}" for name in step.item_order or step.expected if name not in here
    )


def gone_of(study: Study, steps: Iterable[Step], has: Has) -> tuple[set[str], set[str]]:
    """(what ends a visit that comes to it, what is left out) of steps."""
    ends: set[str] = set()
    left_out: set[str] = set()
    for step in steps:
        ends.update(gone(study, step, has))
        left_out.update(items_gone(study, step))
    return ends, left_out


def _needed(step: Step) -> Iterator[tuple[str, str]]:
    text = getattr(step, "text", None)
    if text is not None and not isinstance(step, DebriefStep):
        yield "text", text
    if isinstance(step, QuestionsStep):
        yield "questionnaire", step.questionnaire
    if isinstance(step, RoundStep):
        yield "layout", step.layout
        for agent in step.agents:
            yield "agent", agent


def _there(study: Study, kind: str, name: str, has: Has) -> bool:
    if kind == "text":
        return name in study.texts
    if kind == "questionnaire":
        return name in study.questionnaires
    return has(kind, name)
