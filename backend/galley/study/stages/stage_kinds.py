"""Every kind of stage: its keys in a study file and the step that it becomes, side by side, and the table.

A new kind is a step class, a stage class and its name in `AnyStage` here, a page `KIND.html` among the
templates, its expectations in tests/study/stages/kinds.py, and docs/study-files.md made again. Rounds stand
in `rounds.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

from galley.files.reading import faults
from galley.study.stages.rounds import Rounds, Tutorial
from galley.study.stages.stage import (
    OptionalStage,
    PageStage,
    QuestionsStage,
    Stage,
    TextStage,
    compares,
    questions_words,
    text_words,
)
from galley.study.visit.draft import FIRST
from galley.study.visit.happenings import Agreed, Declined, Happening
from galley.study.visit.steps import (
    Form,
    QuestionnaireStep,
    QuestionsStep,
    ReadingStep,
    Step,
    TextStep,
    Then,
)
from galley.study.written.factors import Conditions, PartnerName, QuestionnaireName, TextName
from galley.study.written.questionnaire import Questionnaire

if TYPE_CHECKING:
    from galley.study.study import Study
    from galley.study.visit.draft import Draft


class ConsentStep(TextStep):
    """The text that the participant agrees to, and the hash of its words."""

    kind = "consent"
    ended_by = (Agreed, Declined)

    def happening(self, form: Form) -> Happening | None:
        """The participant agrees or declines."""
        match form.get("choice", [""])[0]:
            case "agree":
                return Agreed(self.id)
            case "decline":
                return Declined(self.id)
            case _:
                return None


class Consent(TextStage):
    """What the participant agrees to before anything else happens; they may decline."""

    becomes = (ConsentStep,)
    guess_s = 60.0

    kind: Literal["consent"]
    text: TextName
    """A text of questionnaires/texts/; the hash of the exact words agreed to is stored."""


class Questions(QuestionsStage):
    """A questionnaire that does not concern one round, such as a survey; there may be any number of them."""

    becomes = (QuestionnaireStep,)

    kind: Literal["questionnaire"]
    questionnaire: QuestionnaireName
    """A file of questionnaires/."""


class InstructionsStep(ReadingStep):
    """A text to read."""

    kind = "instructions"


class Instructions(TextStage, PageStage):
    """A text to read."""

    becomes = (InstructionsStep,)
    guess_s = 90.0

    kind: Literal["instructions"]
    text: TextName
    """A text of questionnaires/texts/."""


class QuizStep(QuestionnaireStep):
    """Questions that are asked again until all are right or the `tries` are used up."""

    kind = "quiz"

    tries: int
    after_last: Then
    text: str | None = None
    """A text to look at again."""


class Quiz(QuestionsStage):
    """Questions with one right answer each, asked again until all are right or the tries are used up.

    After a wrong answer the page shows the `hint` of its item. The same wrong answers sent again, as by
    loading the page again, are one try.
    """

    becomes = (QuizStep,)

    kind: Literal["quiz"]
    questionnaire: QuestionnaireName
    """A file of questionnaires/; its items with `expected` have to be answered right."""
    tries: int = Field(3, ge=1, le=100)
    """How often it may be answered."""
    after_last: Literal["end", "go_on"] = "end"
    """What follows when the last try is wrong: the end as failed_checks, or the next stage."""
    text: TextName | None = None
    """A text to look at again beside the questions."""
    skippable: Literal[False] = False
    """A quiz may not be left out."""

    def said(self, stage_id: str, draft: Draft) -> dict[str, Any]:
        """The tries, and what may be looked at again, besides."""
        text = None if self.text is None else draft.resolve(self.text)
        tries = {"tries": self.tries, "after_last": self.after_last, "text": text}
        return super().said(stage_id, draft) | tries

    def description(self, study: Study) -> Iterator[str]:
        """The questionnaire, the tries, and what follows them."""
        then = "the visit ends" if self.after_last == "end" else "the visit goes on"
        yield f"{questions_words(study, self.questionnaire)}, {self.tries} tries, then {then}"

    def questionnaire_faults(self, name: str, questionnaire: Questionnaire) -> Iterator[tuple[str, str]]:
        """A quiz needs right answers."""
        yield from super().questionnaire_faults(name, questionnaire)
        if not questionnaire.expected:
            yield f"no item of questionnaire '{name}' has a right answer", "add `expected: ...` to its items"


class BreakStep(ReadingStep):
    """A rest."""

    kind = "break"


class Break(PageStage):
    """A rest; it lasts until the participant goes on, or until its time limit."""

    becomes = (BreakStep,)
    guess_s = 60.0

    kind: Literal["break"]
    text: TextName | None = None
    """A text to show; a plain page of ours without it."""

    def heading(self, draft: Draft) -> str:
        """That of the text, or one of ours."""
        return draft.say("Time for a break") if self.text is None else draft.text_title(self.text)

    def said(self, stage_id: str, draft: Draft) -> dict[str, Any]:
        """The text besides, if there is one."""
        return super().said(stage_id, draft) | ({} if self.text is None else draft.text(self.text))

    def description(self, study: Study) -> Iterator[str]:
        """The break, and its text."""
        yield "a break" if self.text is None else f"a break with {text_words(study, self.text)}"


class ScreenOutStep(Step):
    """The end of a visit, never shown."""

    kind = "screen_out"
    ends_visit_as = "screened_out"


class ScreenOut(OptionalStage):
    """Ends the visit of those who meet its condition, with the code and the page of [endings](#endings)."""

    becomes = (ScreenOutStep,)

    kind: Literal["screen_out"]
    when: Conditions
    """Whom the visit ends for."""

    @model_validator(mode="after")
    def _not_everybody(self) -> Self:
        if not self.conditions:
            fix = "add a condition, such as `{item: survey.age, at_most: 17}`"
            raise faults([(("when",), "this ends the visit of everybody who comes here", fix)])
        return self

    def description(self, study: Study) -> Iterator[str]:
        """What it does."""
        yield "ends the visit as screened out"


class Side(BaseModel):
    """One of the two partners of a comparison."""

    model_config = ConfigDict(frozen=True)

    hat: str
    agent: str


class ComparisonStep(QuestionsStep):
    """Questions about two partners, `first` and `second` as the page calls them."""

    kind = "comparison"
    shown = ("human_hat",)

    human_hat: str
    first: Side
    second: Side

    def public(self) -> dict[str, Any]:
        """The hats."""
        hats = {name: {"hat": side.hat} for name, side in (("first", self.first), ("second", self.second))}
        return super().public() | hats


class Comparison(QuestionsStage):
    """A questionnaire that compares two partners by the colours of their hats.

    Which is called the first is drawn for each visit and stored with the answers.
    """

    becomes = (ComparisonStep,)

    kind: Literal["comparison"]
    questionnaire: QuestionnaireName
    """A file of questionnaires/ with items of kind comparison."""
    agents: tuple[PartnerName, PartnerName] | None = None
    """The two partners, of those met; needed unless there were exactly two."""

    def said(self, stage_id: str, draft: Draft) -> dict[str, Any]:
        """The two partners besides, in an order drawn."""
        agents = [draft.resolve(agent) for agent in self.agents or tuple(draft.hats)[:2]]
        order = (agents[place] for place in draft.by(FIRST)[0].permutation(2))
        first, second = (Side(hat=draft.hats[agent], agent=agent) for agent in order)
        sides = {"human_hat": draft.human_hat, "first": first, "second": second}
        return super().said(stage_id, draft) | sides

    def description(self, study: Study) -> Iterator[str]:
        """The questionnaire and the partners."""
        which = " and ".join(self.agents or ()) or "the two partners"
        yield f"{questions_words(study, self.questionnaire)}, comparing {which}"

    def questionnaire_faults(self, name: str, questionnaire: Questionnaire) -> Iterator[tuple[str, str]]:
        """A comparison needs items that compare."""
        if not compares(questionnaire):
            told = f"questionnaire '{name}' has no comparison item"
            yield told, "use one whose items are of kind comparison"


class DebriefStep(TextStep):
    """The end of a visit that came all the way."""

    kind = "debrief"
    ends_visit_as = "completed"

    completion_code: str
    redirect: str | None = None


class Debrief(TextStage):
    """The end: a text and the completion code."""

    becomes = (DebriefStep,)
    guess_s = 20.0

    kind: Literal["debrief"]
    text: TextName
    """A text of questionnaires/texts/, shown with the completion code."""

    def said(self, stage_id: str, draft: Draft) -> dict[str, Any]:
        """The completion code and where to go besides."""
        end = draft.config.completion
        said = super().said(stage_id, draft)
        return said | {"completion_code": end.code, "redirect": end.redirect}


AnyStage = Annotated[
    Consent | Questions | Instructions | Quiz | Break | ScreenOut | Tutorial | Rounds | Comparison | Debrief,
    Field(discriminator="kind"),
]
"""A stage as a study file writes it."""

STAGE_KINDS: Final[tuple[type[Stage], ...]] = get_args(get_args(AnyStage)[0])

STEP_TYPES: Final[Mapping[str, type[Step]]] = {
    step.kind: step for stage in STAGE_KINDS for step in stage.becomes
}
"""The type of each kind of step."""
