"""What a study file says, before anyone visits: settings and stages in order."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Final, Literal, Self, TypeVar, get_args

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from galley.files import FileModel, Loc, faults
from galley.names import name_fix
from galley.study.items import Text

Hat = Literal["orange", "sky-blue", "bluish-green", "yellow", "blue", "vermillion", "reddish-purple"]
HATS: Final[tuple[Hat, ...]] = get_args(Hat)
"""Colours that colour-blind people can tell apart. Source: Okabe and Ito, Color Universal Design (2008)."""

S = TypeVar("S", bound=str)

DEFAULT_GOAL_TEXT = "Reach {goal} points together to meet this kitchen's goal."

StageId = Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$", max_length=40)]
Ticks = Annotated[int, Field(ge=1, le=32_000)]


def _known(what: str, kind: str) -> AfterValidator:
    """Refuses a name that the workspace, given as validation context {kind: names}, does not hold."""

    def check(name: str, info: ValidationInfo) -> str:
        known: Mapping[str, tuple[str, ...]] = info.context or {}
        if kind in known and name not in known[kind]:
            raise faults([((), f"no {what} is named '{name}'", name_fix(name, known[kind]))])
        return name

    return AfterValidator(check)


LayoutName = Annotated[str, _known("layout", "layouts")]
AgentName = Annotated[str, _known("agent", "agents")]
QuestionnaireName = Annotated[str, _known("questionnaire", "questionnaires")]
TextName = Annotated[str, _known("text", "texts")]


class _Stage(FileModel):
    id: StageId | None = None
    title: str = ""


class Consent(_Stage):
    """What the participant agrees to before anything else happens; they may decline."""

    kind: Literal["consent"]
    text: TextName


class Questions(_Stage):
    """A questionnaire that does not concern one round."""

    kind: Literal["questionnaire"]
    questionnaire: QuestionnaireName


class Instructions(_Stage):
    """A text to read."""

    kind: Literal["instructions"]
    text: TextName


class Tutorial(_Stage):
    """A round for getting used to the kitchen, whose score does not count."""

    kind: Literal["tutorial"]
    layout: LayoutName
    agent: AgentName
    seat: Literal["random", 0, 1] = "random"
    horizon_ticks: Ticks | None = None
    skippable: bool = False


class Kitchen(FileModel):
    """One layout of a rounds stage, and the score to aim for there."""

    layout: LayoutName
    goal: int | None = Field(None, ge=1, le=100_000)


class Rounds(_Stage):
    """Every agent on every layout, one round each, with a questionnaire after each.

    Layouts come in the order written. On each layout the agents' order is drawn for each visit, or is as
    written with `agent_order: fixed`. The participant's seat is drawn once a layout (`per_layout`: both
    agents are met from the same place), for each round (`per_round`), or given.
    """

    kind: Literal["rounds"]
    agents: tuple[AgentName, ...] = Field(min_length=1)
    layouts: tuple[Kitchen, ...] = Field(min_length=1)
    agent_order: Literal["random", "fixed"] = "random"
    seats: Literal["per_layout", "per_round", 0, 1] = "per_layout"
    after_each: QuestionnaireName | None = None
    goal_text: str = DEFAULT_GOAL_TEXT

    @field_validator("agents")
    @classmethod
    def _agents_differ(cls, agents: tuple[str, ...]) -> tuple[str, ...]:
        return _differ(agents, "agent")

    @field_validator("goal_text")
    @classmethod
    def _goal_text_has_only_the_goal(cls, text: str) -> str:
        unknown = [name for name in re.findall(r"\{(.*?)\}", text) if name != "goal"]
        if unknown:
            raise faults([((), f"'{{{unknown[0]}}}' is unknown in the goal's text", "use {goal}")])
        return text


class Comparison(_Stage):
    """A questionnaire that compares two partners by hat colour; which is first is drawn for each visit."""

    kind: Literal["comparison"]
    questionnaire: QuestionnaireName
    agents: tuple[AgentName, AgentName] | None = None


class Debrief(_Stage):
    """The end: a text and the completion code."""

    kind: Literal["debrief"]
    text: TextName


Stage = Annotated[
    Consent | Questions | Instructions | Tutorial | Rounds | Comparison | Debrief, Field(discriminator="kind")
]


class Completion(FileModel):
    """What a participant who reached the end takes away: a code, and perhaps an address to go to."""

    code: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=64)]
    redirect: Annotated[str, Field(pattern=r"^https://\S+$", max_length=500)] | None = None


class StudyFile(FileModel):
    """A study file. Times are in ticks of `tick_ms` milliseconds or in seconds, as their names say."""

    format: Literal[1]
    title: Text
    about: str = ""
    seed: int = Field(ge=0, lt=2**63)
    minutes: int | None = Field(None, ge=1, le=600)
    tick_ms: int = Field(150, ge=20, le=2000)
    horizon_ticks: Ticks = 400
    countdown_s: Annotated[int, Field(ge=0, le=30)] = 3
    abandon_after_s: Annotated[int, Field(ge=1, le=3600)] = 60
    hats: tuple[Hat, ...] = HATS
    completion: Completion
    stages: tuple[Stage, ...] = Field(min_length=2)

    @field_validator("hats")
    @classmethod
    def _hats_differ(cls, hats: tuple[Hat, ...]) -> tuple[Hat, ...]:
        return _differ(hats, "hat")

    @field_validator("stages")
    @classmethod
    def _stages_fit_together(cls, stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
        found = [*_order_faults(stages), *_id_faults(stages), *_comparison_faults(stages)]
        if found:
            raise faults(found)
        return stages

    @model_validator(mode="after")
    def _hats_suffice(self) -> Self:
        wanted = 1 + len(played_agents(self.stages)) + any(isinstance(s, Tutorial) for s in self.stages)
        if len(self.hats) < wanted:
            told = f"{len(self.hats)} hats for a participant, their partners and the tutorial's partner"
            raise faults([(("hats",), told, f"name {wanted} or more of {' '.join(HATS)}")])
        return self


def played_agents(stages: tuple[Stage, ...]) -> tuple[str, ...]:
    """The agents of all rounds stages, each once, in the order they are first named."""
    return tuple(dict.fromkeys(a for stage in stages if isinstance(stage, Rounds) for a in stage.agents))


def stage_ids(stages: tuple[Stage, ...]) -> tuple[str, ...]:
    """Each stage's id: as written, else its kind, with a number from the second of a kind on."""
    counted: dict[str, int] = {}
    ids = []
    for stage in stages:
        counted[stage.kind] = counted.get(stage.kind, 0) + 1
        number = counted[stage.kind]
        ids.append(stage.id or (stage.kind if number == 1 else f"{stage.kind}-{number}"))
    return tuple(ids)


def _differ(names: tuple[S, ...], what: str) -> tuple[S, ...]:
    twice = [place for place, name in enumerate(names) if name in names[:place]]
    if twice:
        raise faults([((p,), f"{what} '{names[p]}' stands twice", "name each once") for p in twice])
    return names


def _order_faults(stages: tuple[Stage, ...]) -> Iterator[tuple[Loc, str, str]]:
    if not isinstance(stages[0], Consent):
        yield (0,), "the first stage is not consent", "start with `- {kind: consent, text: ...}`"
    if not isinstance(stages[-1], Debrief):
        last = len(stages) - 1
        yield (last,), "the last stage is not debrief", "end with `- {kind: debrief, text: ...}`"
    for place, stage in enumerate(stages):
        if isinstance(stage, Consent) and place > 0:
            yield (place,), "consent comes after another stage", "make it the first and only one"
        if isinstance(stage, Debrief) and place < len(stages) - 1:
            yield (place,), "a stage comes after debrief", "make debrief the last and only one"


def _id_faults(stages: tuple[Stage, ...]) -> Iterator[tuple[Loc, str, str]]:
    ids = stage_ids(stages)
    for place, stage_id in enumerate(ids):
        if stage_id in ids[:place]:
            yield (place, "id"), f"stage id '{stage_id}' stands twice", "give each stage its own id"


def _comparison_faults(stages: tuple[Stage, ...]) -> Iterator[tuple[Loc, str, str]]:
    for place, stage in enumerate(stages):
        if not isinstance(stage, Comparison):
            continue
        met = played_agents(stages[:place])
        if stage.agents is None:
            if len(met) != 2:
                told = f"the rounds before this comparison have {len(met)} agents, not two"
                some = " ".join(met) or "the agents met"
                yield (place,), told, f"add `agents: [FIRST, SECOND]`, two of {some}"
            continue
        for n, agent in enumerate(stage.agents):
            if agent not in met:
                yield (place, "agents", n), f"agent '{agent}' is not met before", name_fix(agent, met)
        if stage.agents[0] == stage.agents[1]:
            yield (place, "agents"), "an agent is compared with itself", "name two agents"
