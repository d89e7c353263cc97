"""What the steps of a visit have in common: one screen each, stored in the visit's plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final, Literal

from pydantic import BaseModel, ConfigDict

from galley.outcomes import VisitOutcome
from galley.study.visit.happenings import Continued, Happening, Submitted
from galley.study.written.factors import Condition

Then = Literal["go_on", "end"]
"""What follows a time limit or a last try: the next step, or the end of the visit."""

Form = Mapping[str, Sequence[str]]
"""The values of each field of a form, as sent."""

_HEAD: Final = ("id", "title")


class Step(BaseModel):
    """One screen of a visit; agents, seeds and right answers in it are for the server alone.

    Every kind of step is a class of its own, beside the stage that it belongs to. Its fields are what a plan
    stores of it; what older plans do not have takes a default.
    """

    model_config = ConfigDict(frozen=True)

    kind: ClassVar[str]
    ended_by: ClassVar[tuple[type[Happening], ...]] = ()
    """What ends it, besides skipping and time limits."""
    ends_visit_as: ClassVar[VisitOutcome | None] = None
    """How a visit that comes to it ends at once; None if it does not."""
    shown: ClassVar[tuple[str, ...]] = ()
    """Those of its fields that its page is given."""
    seldom: ClassVar[tuple[str, ...]] = ("when", "skippable", "time_limit_s", "at_limit", "at_least_s")
    """Those of its fields that a plan stores only where they say something."""

    id: str
    title: str
    when: tuple[Condition, ...] = ()
    """What earlier answers have to be for the step to be met; all must hold."""
    skippable: bool = False
    """Whether the participant may leave it out."""
    time_limit_s: int | None = None
    """How long the participant may take, from the first time they see it."""
    at_limit: Then = "go_on"
    """What follows when the time is up: the next step, or the end as timed_out."""
    at_least_s: int = 0
    """How long the participant has to stay."""

    def happening(self, form: Form) -> Happening | None:
        """What a form of its page, without problems, means for the visit; None when it says nothing."""
        return None

    def public(self) -> dict[str, Any]:
        """What its page may know of it."""
        return {name: getattr(self, name) for name in self.shown}

    def stored(self) -> dict[str, Any]:
        """The step as JSON for a plan: `id`, `kind`, `title`, and all else under `data`."""
        values = self.model_dump(mode="json", exclude={*_HEAD, "when"})
        values["when"] = [one.model_dump(mode="json", exclude_defaults=True) for one in self.when]
        usual = {name: field.default for name, field in type(self).model_fields.items()}
        limited = () if self.time_limit_s is None else ("at_limit",)
        said = [name for name in self.seldom if name in limited or getattr(self, name) != usual[name]]
        order = [*(name for name in values if name not in self.seldom), *said]
        data = {name: values[name] for name in order}
        return {"id": self.id, "kind": self.kind, "title": self.title, "data": data}


class TextStep(Step):
    """A step that shows a text, or a plain page of ours when there is none."""

    text: str | None = None
    sha256: str | None = None
    """The hash of the words as they were when the visit began."""


class ReadingStep(TextStep):
    """A step that is over when the participant goes on."""

    ended_by = (Continued,)

    def happening(self, form: Form) -> Happening | None:
        """The participant goes on."""
        return Continued(self.id)


class QuestionsStep(Step):
    """A step that asks the items of a questionnaire, in the order `item_order` of their ids."""

    ended_by = (Submitted,)

    questionnaire: str
    item_order: tuple[str, ...] | None = None
    expected: Mapping[str, Any] = {}
    """The right answer of every item that has one."""

    def happening(self, form: Form) -> Happening | None:
        """The answers are in."""
        return Submitted(self.id)


class QuestionnaireStep(QuestionsStep):
    """Questions, about the round `round_no` and the partner in it if they follow one."""

    kind = "questionnaire"
    shown = ("round_no", "partner_hat", "human_hat")

    round_no: int | None = None
    partner_hat: str | None = None
    human_hat: str | None = None
