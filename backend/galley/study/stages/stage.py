"""What the stages of a study have in common, and what every kind of them answers for itself."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator

from galley.files.reading import FileModel, Loc, faults
from galley.study.visit.steps import Step, Then
from galley.study.written.factors import (
    Condition,
    Conditions,
    Counted,
    QuestionnaireName,
    TextName,
    levels_of,
)
from galley.study.written.languages import Words
from galley.study.written.questionnaire import Questionnaire

if TYPE_CHECKING:
    from galley.study.study import Study
    from galley.study.visit.draft import Draft
    from galley.study.written.study_file import StudyFile

StageId = Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$", max_length=40)]
Seconds = Annotated[int, Field(ge=1, le=7200)]
ITEM_S: Final = 6
"""A guess of how long people take to answer an item."""

NamedKind = Literal["texts", "questionnaires", "layouts", "agents"]


class Stage(FileModel):
    """One line of a study's stages. A kind of stage is a subclass with its keys and its answers."""

    becomes: ClassVar[tuple[type[Step], ...]]
    """The kinds of step that it becomes in a visit."""
    guess_s: ClassVar[float] = 0.0
    """A guess of how long it takes, where nothing in it decides that."""

    kind: str
    id: StageId | None = None
    """Names the stage in exports and conditions; its kind (and a number) without it."""
    title: Words = ""
    """The heading of its page, instead of its own."""

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """What has to hold for the stage to be met."""
        return ()

    @property
    def rounds(self) -> int:
        """How many rounds that count a visit plays in it."""
        return 0

    @property
    def partners(self) -> tuple[str, ...]:
        """The partners of these rounds, as written."""
        return ()

    @property
    def asks(self) -> str | None:
        """The questionnaire whose answers later conditions may ask for."""
        return None

    def steps(self, stage_id: str, draft: Draft) -> Iterator[Step]:
        """What the stage is to one visit: one step that says `said`, unless its kind becomes several."""
        yield self.becomes[0](**self.said(stage_id, draft))

    def said(self, stage_id: str, draft: Draft) -> dict[str, Any]:
        """The fields of its step."""
        return {"id": stage_id, "title": self.title or self.heading(draft), **self.rules()}

    def heading(self, draft: Draft) -> str:
        """The heading of its page where the file gives it none."""
        return ""

    @abstractmethod
    def description(self, study: Study) -> Iterator[str]:
        """What participants meet, in lines of plain text."""

    def seconds(self, config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> float:
        """A guess of how long it takes those who meet all of it."""
        return self.guess_s

    def names(self) -> Iterator[tuple[NamedKind, str, Loc]]:
        """(kind of thing, name, place in the stage) of all that it names; a name may be a `$factor`."""
        named: tuple[tuple[NamedKind, str], ...] = (("texts", "text"), ("questionnaires", "questionnaire"))
        for kind, key in named:
            name = getattr(self, key, None)
            if name is not None:
                yield kind, name, (key,)

    def meetings(self) -> Iterator[tuple[str, str, Loc]]:
        """(agent, layout, place of the agent in the stage) of every round that some visit may play."""
        return iter(())

    def needed(self) -> dict[Counted, int]:
        """How many participants of a cell balance each order that is counted through, by its key."""
        return {}

    def questionnaire_faults(self, name: str, questionnaire: Questionnaire) -> Iterator[tuple[str, str]]:
        """(What is wrong, fix) of a questionnaire that the stage is not made for."""
        if compares(questionnaire):
            told = f"questionnaire '{name}' compares two partners, but a {self.kind} stage shows none"
            yield told, "use it in a comparison stage"

    def meets(self, condition: Mapping[str, str]) -> bool:
        """Whether visits of this condition meet the stage, as far as factors decide."""
        asked = (one for one in self.conditions if one.factor is not None)
        return all(one.holds(condition[str(one.factor)]) for one in asked)

    def rules(self) -> dict[str, Any]:
        """What its steps say of skipping, time and answers, as far as it has such keys."""
        return {}

    def rules_description(self) -> Iterator[str]:
        """What participants are told of conditions, skipping and time, in lines of plain text."""
        if self.conditions:
            yield f"only if {' and '.join(map(_condition_words, self.conditions))}"
        if getattr(self, "skippable", False):
            yield "may be left out"


class OptionalStage(Stage):
    """A stage that is met by those for whom its conditions hold."""

    when: Conditions = ()
    """One condition or a list of conditions that must all hold, else the stage is left out."""

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """What has to hold for the stage to be met."""
        return (self.when,) if isinstance(self.when, Condition) else tuple(self.when)

    def rules(self) -> dict[str, Any]:
        """The conditions that only answers decide."""
        return {"when": tuple(one for one in self.conditions if one.factor is None)}


class PageStage(OptionalStage):
    """A stage of one page, which may be left out and may have its time."""

    skippable: bool = False
    """Whether the participant may leave it out."""
    time_limit_s: Seconds | None = None
    """Seconds until it is over."""
    at_limit: Then = "go_on"
    """What follows then: the next stage, or the end as timed_out."""
    at_least_s: int = Field(0, ge=0, le=3600)
    """Seconds before the participant may go on."""

    @model_validator(mode="after")
    def _can_be_left_in_time(self) -> Self:
        if self.time_limit_s is not None and self.at_least_s >= self.time_limit_s:
            told = f"nobody may go on before {self.at_least_s} s, but the time limit is {self.time_limit_s} s"
            raise faults([(("at_least_s",), told, "make it shorter than the limit")])
        return self

    def rules(self) -> dict[str, Any]:
        """Conditions, whether it may be left out, and its time."""
        rules: dict[str, Any] = {"skippable": self.skippable, "at_least_s": self.at_least_s}
        if self.time_limit_s is not None:
            rules |= {"time_limit_s": self.time_limit_s, "at_limit": self.at_limit}
        return super().rules() | rules

    def rules_description(self) -> Iterator[str]:
        """What participants are told of conditions, skipping and time, in lines of plain text."""
        yield from super().rules_description()
        if self.time_limit_s is not None:
            then = "ends" if self.at_limit == "end" else "goes on"
            yield f"at most {self.time_limit_s} s, then the visit {then}"
        if self.at_least_s:
            yield f"at least {self.at_least_s} s"

    def seconds(self, config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> float:
        """A guess, cut at the time limit."""
        return min(self.guess_s, self.time_limit_s or math.inf)


class TextStage(Stage):
    """A stage of one page that shows a text."""

    text: TextName

    def heading(self, draft: Draft) -> str:
        """That of the text."""
        return draft.text_title(self.text)

    def said(self, stage_id: str, draft: Draft) -> dict[str, Any]:
        """The text and the hash of its words besides."""
        return super().said(stage_id, draft) | draft.text(self.text)

    def description(self, study: Study) -> Iterator[str]:
        """The text."""
        yield text_words(study, self.text)


class QuestionsStage(PageStage):
    """A stage of one page that asks the items of a questionnaire."""

    questionnaire: QuestionnaireName

    @property
    def asks(self) -> str:
        """The questionnaire."""
        return self.questionnaire

    def heading(self, draft: Draft) -> str:
        """That of the questionnaire."""
        return draft.questions_title(self.questionnaire)

    def said(self, stage_id: str, draft: Draft) -> dict[str, Any]:
        """The questionnaire, the order of its items and the right answers besides."""
        return super().said(stage_id, draft) | draft.questions(self.questionnaire)

    def description(self, study: Study) -> Iterator[str]:
        """The questionnaire."""
        yield questions_words(study, self.questionnaire)

    def seconds(self, config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> float:
        """A guess from the number of items, cut at the time limit."""
        return min(answer_s(config, questionnaires, self.questionnaire), self.time_limit_s or math.inf)


def stage_ids(stages: Iterable[Stage]) -> tuple[str, ...]:
    """Each stage's id: as written, else its kind, with a number from the second of a kind on."""
    counted: dict[str, int] = {}
    ids = []
    for stage in stages:
        counted[stage.kind] = counted.get(stage.kind, 0) + 1
        number = counted[stage.kind]
        name = stage.kind.replace("_", "-")
        ids.append(stage.id or (name if number == 1 else f"{name}-{number}"))
    return tuple(ids)


def answer_s(config: StudyFile, questionnaires: Mapping[str, Questionnaire], name: str) -> float:
    """A guess of how many seconds a questionnaire takes, the longest that a `$factor` may stand for."""
    known = [questionnaires[n] for n in levels_of(name, config.factors) if n in questionnaires]
    return ITEM_S * max((len(questionnaire.items) for questionnaire in known), default=0)


def compares(questionnaire: Questionnaire) -> bool:
    """Whether a questionnaire compares two partners."""
    return any(item.compares for item in questionnaire.items)


def text_words(study: Study, name: str) -> str:
    """A text as a description calls it: by its heading, or by the factor that decides it."""
    return f"text '{study.texts[name].title if name in study.texts else name}'"


def questions_words(study: Study, name: str) -> str:
    """A questionnaire as a description calls it: by its heading, or by the factor that decides it."""
    if name not in study.questionnaires:
        return f"questionnaire {name}"
    questionnaire = study.questionnaires[name]
    shuffled = " in an order drawn for each visit" if questionnaire.order == "random" else ""
    return f"questionnaire '{questionnaire.title}', {len(questionnaire.items)} items{shuffled}"


def _condition_words(condition: Condition) -> str:
    told = []
    for words, values in (("is", condition.any_of), ("is not", condition.none_of)):
        if values:
            told.append(f"{words} {' or '.join(map(str, values))}")
    if condition.at_least is not None:
        told.append(f"is at least {condition.at_least:g}")
    if condition.at_most is not None:
        told.append(f"is at most {condition.at_most:g}")
    return f"{condition.item or condition.factor} {' and '.join(told)}"
