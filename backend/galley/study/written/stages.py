"""The stages of a study, as its file describes them."""

from __future__ import annotations

import re
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, field_validator, model_validator

from galley.files.reading import FileModel, Loc, faults
from galley.study.visit.counterbalance import MOST_SEQUENCES, permutations_count, sequences
from galley.study.written.factors import (
    Condition,
    Conditions,
    Counted,
    LayoutName,
    Order,
    PartnerName,
    QuestionnaireName,
    TextName,
    known_name,
)
from galley.study.written.languages import Words

HUMAN: Final = "human"
"""Named as an agent: another participant."""

ALONE: Final = "none"
"""Named as a tutorial's agent: nobody is seen."""

StageId = Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$", max_length=40)]
Ticks = Annotated[int, Field(ge=1, le=32_000)]
TickMs = Annotated[int, Field(ge=20, le=2000)]
Seconds = Annotated[int, Field(ge=1, le=7200)]
InputMode = Literal["hold", "press"]


class _Named(FileModel):
    id: StageId | None = None
    """Names the stage in exports and conditions; its kind (and a number) without it."""
    title: Words = ""
    """The heading of its page, instead of its own."""


class _Stage(_Named):
    when: Conditions = ()
    """One condition or a list of conditions that must all hold, else the stage is left out."""


class _Page(_Stage):
    skippable: bool = False
    """Whether the participant may leave it out."""
    time_limit_s: Seconds | None = None
    """Seconds until it is over."""
    at_limit: Literal["go_on", "end"] = "go_on"
    """What follows then: the next stage, or the end as timed_out."""
    at_least_s: int = Field(0, ge=0, le=3600)
    """Seconds before the participant may go on."""

    @model_validator(mode="after")
    def _can_be_left_in_time(self) -> Self:
        if self.time_limit_s is not None and self.at_least_s >= self.time_limit_s:
            told = f"nobody may go on before {self.at_least_s} s, but the time limit is {self.time_limit_s} s"
            raise faults([(("at_least_s",), told, "make it shorter than the limit")])
        return self


class Consent(_Named):
    """What the participant agrees to before anything else happens; they may decline."""

    kind: Literal["consent"]
    text: TextName
    """A text of questionnaires/texts/; the hash of the exact words agreed to is stored."""


class Questions(_Page):
    """A questionnaire that does not concern one round."""

    kind: Literal["questionnaire"]
    questionnaire: QuestionnaireName
    """A file of questionnaires/."""


class Instructions(_Page):
    """A text to read."""

    kind: Literal["instructions"]
    text: TextName
    """A text of questionnaires/texts/."""


class Quiz(_Page):
    """Questions with one right answer each, asked again until all are right or the tries are used up."""

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


class Break(_Page):
    """A rest; it lasts until the participant goes on, or until its time limit."""

    kind: Literal["break"]
    text: TextName | None = None
    """A text to show; a plain page of ours without it."""


class ScreenOut(_Stage):
    """Ends the visit of those who meet its condition."""

    kind: Literal["screen_out"]
    when: Conditions
    """Whom the visit ends for."""

    @model_validator(mode="after")
    def _not_everybody(self) -> Self:
        if not conditions_of(self):
            fix = "add a condition, such as `{item: survey.age, at_most: 17}`"
            raise faults([(("when",), "this ends the visit of everybody who comes here", fix)])
        return self


class Tutorial(_Stage):
    """A round for getting used to the kitchen, whose score does not count; with agent `none` it is alone."""

    kind: Literal["tutorial"]
    layout: LayoutName
    """The kitchen."""
    agent: Annotated[str, known_name("agent", "agents", ALONE)]
    """The partner; `stay` stands still, `none` is not seen and needs a kitchen such as practice_alone."""
    seat: Literal["random", 0, 1] = "random"
    """The participant's seat."""
    horizon_ticks: Ticks | None = None
    """Ticks of an episode, instead of the study's."""
    tick_ms: TickMs | None = None
    """Milliseconds per tick, instead of the study's."""
    episodes: int = Field(1, ge=1, le=50)
    """How many episodes the round has, each from a fresh kitchen."""
    input_mode: InputMode | None = None
    """How keys act, instead of the study's."""
    show_score: Literal["during", "after", "never"] = "during"
    """When the score is shown."""
    skippable: bool = False
    """Whether the participant may leave it out."""

    @model_validator(mode="after")
    def _alone_on_a_known_seat(self) -> Self:
        if self.agent == ALONE and self.seat == "random":
            fix = "add `seat: 0` or `seat: 1`, the start that is not walled off"
            raise faults([(("agent",), "a tutorial alone needs a seat", fix)])
        return self


class Kitchen(FileModel):
    """One layout of a rounds stage, the score to aim for there, and what differs from the other rounds."""

    layout: LayoutName
    """Name or alias of a layout."""
    goal: int | None = Field(None, ge=1, le=100_000)
    """The score to aim for, over all episodes."""
    bonus: float | None = Field(None, gt=0, le=100_000)
    """What reaching the goal earns, in `bonus_unit`."""
    horizon_ticks: Ticks | None = None
    """Ticks of an episode on this layout."""
    tick_ms: TickMs | None = None
    """Milliseconds per tick on this layout."""

    @model_validator(mode="after")
    def _a_bonus_needs_a_goal(self) -> Self:
        if self.bonus is not None and self.goal is None:
            raise faults([(("bonus",), "a bonus without a goal cannot be earned", "add `goal: ...`")])
        return self


class Lobby(FileModel):
    """How participants of `human` rounds find each other, and what happens when one is not there.

    `fallback` after `wait_s`: `exit` ends the visit as partner_missing, `go_on` leaves the round out, an
    agent's name plays instead. `dropout` when the other one leaves: `end_round`, or an agent who takes over.
    """

    wait_s: Seconds = 120
    """Seconds to wait for another participant."""
    fallback: Annotated[str, known_name("agent", "agents", "exit", "go_on")] = "exit"
    """What follows then: `exit` ends the visit as partner_missing, `go_on` leaves the round out, an agent
    plays instead."""
    dropout: Annotated[str, known_name("agent", "agents", "end_round")] = "end_round"
    """What follows when the other one leaves for good: the round ends, or an agent takes over."""

    @property
    def agents(self) -> tuple[tuple[str, str], ...]:
        """(key, agent) of those that may step in."""
        named = (("fallback", self.fallback), ("dropout", self.dropout))
        return tuple((key, name) for key, name in named if name not in ("exit", "go_on", "end_round"))


class Rounds(_Stage):
    """Every agent on every layout, one round each, with a questionnaire after each.

    Rounds come in blocks: all agents on one layout, then the next layout (`blocks: layout`), or all layouts
    with one agent, then the next agent (`blocks: agent`). An order is as written (`fixed`), drawn for each
    visit (`random`), a row of a Latin square (`latin_square`), or one of all there are, each equally often
    (`full`). What comes inside the blocks has an order of its own in every block. With `pairs` other than
    `all` each layout is played once, with one of the agents. The participant's seat belongs to a layout
    (`per_layout`: every agent is met from the same place), to a round (`per_round`), or is given.
    """

    kind: Literal["rounds"]
    agents: tuple[PartnerName, ...] = Field(min_length=1, max_length=20)
    """The partners; `human` is another participant."""
    layouts: tuple[Kitchen, ...] = Field(min_length=1, max_length=100)
    """The kitchens, one line each."""
    blocks: Literal["layout", "agent"] = "layout"
    """All agents on a layout before the next layout, or all layouts with an agent before the next agent."""
    pairs: Literal["all", "random", "fixed", "latin_square", "full"] = "all"
    """Every agent on every layout, or each layout once with one of the agents: see Balance."""
    layout_order: Order = "fixed"
    """The order of the layouts: see Balance."""
    agent_order: Order = "random"
    """The order of the agents: see Balance."""
    seats: Literal["per_layout", "per_round", 0, 1] = "per_layout"
    """What the participant's seat belongs to: a layout, a round, or always the same one."""
    seat_order: Order = "random"
    """How seats are given: see Balance."""
    horizon_ticks: Ticks | None = None
    """Ticks of an episode, instead of the study's."""
    tick_ms: TickMs | None = None
    """Milliseconds per tick, instead of the study's."""
    episodes: int = Field(1, ge=1, le=50)
    """How many episodes a round has, each from a fresh kitchen; the score adds up."""
    input_mode: InputMode | None = None
    """How keys act, instead of the study's."""
    show_score: Literal["during", "after", "never"] = "during"
    """When the score is shown."""
    after_each: QuestionnaireName | None = None
    """A questionnaire after each round."""
    goal_text: Words = ""
    """The line that tells the goal, with `{goal}` and `{bonus}` in it; ours without it."""
    lobby: Lobby | None = None
    """How `human` partners find each other."""
    skippable: bool = False
    """Whether the participant may leave rounds out."""

    @property
    def count(self) -> int:
        """How many rounds a visit plays in this stage."""
        return len(self.layouts) * (len(self.agents) if self.pairs == "all" else 1)

    def needed(self) -> dict[Counted, int]:
        """How many participants of a cell balance each order that is counted through, by its key."""
        layouts, agents = len(self.layouts), len(self.agents)
        by_agent = self.blocks == "agent"
        units = self.count if self.seats == "per_round" else layouts
        counts: dict[Counted, int] = {
            "layout_order": sequences(self.layout_order, layouts, agents if by_agent else 1)
        }
        if self.pairs == "all":
            counts["agent_order"] = sequences(self.agent_order, agents, 1 if by_agent else layouts)
        else:
            of_pairs = {"latin_square": agents, "full": permutations_count(agents)}
            counts["pairs"] = of_pairs.get(self.pairs, 0)
        if not isinstance(self.seats, int):
            counts["seat_order"] = {"latin_square": 2, "full": 2**units}.get(self.seat_order, 0)
        return {key: count for key, count in counts.items() if count > 1}

    @field_validator("agents")
    @classmethod
    def _agents_differ(cls, agents: tuple[str, ...]) -> tuple[str, ...]:
        return names_differ(agents, "agent")

    @field_validator("goal_text")
    @classmethod
    def _goal_text_has_only_the_goal(cls, text: str) -> str:
        unknown = [name for name in re.findall(r"\{(.*?)\}", text) if name not in ("goal", "bonus")]
        if unknown:
            raise faults([((), f"'{{{unknown[0]}}}' is unknown in the goal's text", "use {goal} or {bonus}")])
        return text

    @model_validator(mode="after")
    def _keys_fit_together(self) -> Self:
        found: list[tuple[Loc, str, str]] = [
            (
                (key,),
                f"full counterbalancing here needs {count} participants in every cell",
                f"use latin_square or random, or fewer layouts and agents (at most {MOST_SEQUENCES})",
            )
            for key, count in self.needed().items()
            if count > MOST_SEQUENCES
        ]
        if self.pairs != "all" and self.blocks == "agent":
            told = "blocks of one agent need every agent on every layout"
            found.append((("pairs",), told, "use `blocks: layout`, or `pairs: all`"))
        if HUMAN in self.agents:
            found += self._human_faults()
        elif self.lobby is not None:
            fix = "name `human` among the agents, or remove it"
            found.append((("lobby",), "a lobby is for rounds with another participant", fix))
        if found:
            raise faults(found)
        return self

    def _human_faults(self) -> list[tuple[Loc, str, str]]:
        """Two participants meet only if both come to the same round at the same time."""
        found: list[tuple[Loc, str, str]] = []
        orders = (
            ("layout_order", self.layout_order, len(self.layouts)),
            ("agent_order", self.agent_order, len(self.agents)),
        )
        for key, order, count in orders:
            if order != "fixed" and count > 1:
                told = f"participants who play with each other need the same order, not {key} '{order}'"
                found.append(((key,), told, f"write `{key}: fixed`"))
        if self.pairs not in ("all", "fixed"):
            told = f"participants who play with each other need the same pairs, not '{self.pairs}'"
            found.append((("pairs",), told, "write `pairs: fixed`, or `pairs: all`"))
        return found


class Comparison(_Page):
    """A questionnaire that compares two partners by hat colour; which is first is drawn for each visit."""

    kind: Literal["comparison"]
    questionnaire: QuestionnaireName
    """A file of questionnaires/ with items of kind comparison."""
    agents: tuple[PartnerName, PartnerName] | None = None
    """The two partners, of those met; needed unless there were exactly two."""


class Debrief(_Named):
    """The end: a text and the completion code."""

    kind: Literal["debrief"]
    text: TextName
    """A text of questionnaires/texts/, shown with the completion code."""


Stage = Annotated[
    Consent | Questions | Instructions | Quiz | Break | ScreenOut | Tutorial | Rounds | Comparison | Debrief,
    Field(discriminator="kind"),
]


def conditions_of(stage: Any) -> tuple[Condition, ...]:
    """The conditions of a stage; consent and debrief have none."""
    when = getattr(stage, "when", ())
    return (when,) if isinstance(when, Condition) else tuple(when)


def stage_ids(stages: tuple[Stage, ...]) -> tuple[str, ...]:
    """Each stage's id: as written, else its kind, with a number from the second of a kind on."""
    counted: dict[str, int] = {}
    ids = []
    for stage in stages:
        counted[stage.kind] = counted.get(stage.kind, 0) + 1
        number = counted[stage.kind]
        name = stage.kind.replace("_", "-")
        ids.append(stage.id or (name if number == 1 else f"{name}-{number}"))
    return tuple(ids)


def names_differ(names: tuple[Any, ...], what: str) -> tuple[Any, ...]:
    """The names, each of which has to stand once."""
    twice = [place for place, name in enumerate(names) if name in names[:place]]
    if twice:
        raise faults([((p,), f"{what} '{names[p]}' stands twice", "name each once") for p in twice])
    return names
