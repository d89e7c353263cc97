"""Stages of rounds, the tutorial among them: their keys in a study file, and the rounds of a visit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

from pydantic import Field, field_validator, model_validator

from galley.files.reading import FileModel, Loc, faults
from galley.study.stages.round_step import (
    ALONE,
    ALONE_AGENT,
    DROPOUTS,
    FALLBACKS,
    HUMAN,
    Bonus,
    Goal,
    InputMode,
    LobbyRules,
    RoundStep,
    ShowScore,
)
from galley.study.stages.rounds_described import described_rounds, described_tutorial
from galley.study.stages.stage import NamedKind, OptionalStage, Seconds, answer_s
from galley.study.visit.counterbalance import (
    MOST_SEQUENCES,
    bits,
    orders,
    permutations_count,
    sequences,
    spread,
)
from galley.study.visit.draft import AGENTS, LAYOUTS, PAIRS, SEATS
from galley.study.visit.steps import QuestionnaireStep, Step
from galley.study.written.factors import (
    Counted,
    LayoutName,
    Order,
    PartnerName,
    QuestionnaireName,
    known_name,
    names_differ,
)
from galley.study.written.languages import Words
from galley.study.written.questionnaire import Questionnaire

if TYPE_CHECKING:
    from galley.study.study import Study
    from galley.study.visit.draft import Draft
    from galley.study.written.study_file import StudyFile

ROUND_EXTRA_S: Final = 8
"""A guess of how long people take to start and leave a round."""

Ticks = Annotated[int, Field(ge=1, le=32_000)]
TickMs = Annotated[int, Field(ge=20, le=2000)]


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

    `fallback` after `wait_s`: `exit` ends the visit as partner_missing, or partner_lost after a round with
    somebody; `go_on` leaves the round out and is the better choice where rounds were played before, for the
    closing questions are still asked; an agent's name plays instead. `dropout` when the other one leaves:
    `end_round`, or an agent who takes over.
    """

    wait_s: Seconds = 120
    """Seconds to wait for another participant."""
    fallback: Annotated[str, known_name("agent", "agents", *FALLBACKS)] = "exit"
    """What follows then: `exit` ends the visit as partner_missing or partner_lost, `go_on` leaves the round
    out, an agent plays instead."""
    dropout: Annotated[str, known_name("agent", "agents", *DROPOUTS)] = "end_round"
    """What follows when the other one leaves for good: the round ends, or an agent takes over."""

    @property
    def agents(self) -> tuple[tuple[str, str], ...]:
        """(key, agent) of those that may step in."""
        named = (("fallback", self.fallback), ("dropout", self.dropout))
        return tuple((key, name) for key, name in named if name not in (*FALLBACKS, *DROPOUTS))


class Tutorial(OptionalStage):
    """A round for getting used to the kitchen, whose score does not count; with agent `none` it is alone.

    Its partner wears a hat that no other partner wears.
    """

    becomes = (RoundStep,)

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
    show_score: ShowScore = "during"
    """When the score is shown."""
    skippable: bool = False
    """Whether the participant may leave it out."""

    @model_validator(mode="after")
    def _alone_on_a_known_seat(self) -> Self:
        if self.agent == ALONE and self.seat == "random":
            fix = "add `seat: 0` or `seat: 1`, the start that is not walled off"
            raise faults([(("agent",), "a tutorial alone needs a seat", fix)])
        return self

    def steps(self, stage_id: str, draft: Draft) -> Iterator[Step]:
        """The one round."""
        draw = draft.by(SEATS)[0]
        seat = int(draw.integers(2)) if self.seat == "random" else self.seat
        played = _played(self, draft, Kitchen(layout=self.layout), draft.resolve(self.agent), seat)
        title = self.title or draft.say("Practice round")
        hats = {"human_hat": draft.human_hat, "partner_hat": draft.tutorial_hat}
        more = {"round_no": 0, "tutorial": True, "scored": False}
        yield RoundStep(id=stage_id, title=title, **hats, **(played | more))

    def names(self) -> Iterator[tuple[NamedKind, str, Loc]]:
        """The layout and the agent."""
        yield "layouts", self.layout, ("layout",)
        yield "agents", ALONE_AGENT if self.agent == ALONE else self.agent, ("agent",)

    def meetings(self) -> Iterator[tuple[str, str, Loc]]:
        """The partner, unless it is alone."""
        if self.agent != ALONE:
            yield self.agent, self.layout, ("agent",)

    def description(self, study: Study) -> Iterator[str]:
        """The kitchen, the partner and the length."""
        yield from described_tutorial(study, self)

    def seconds(self, config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> float:
        """Its countdown and ticks, and a guess of the rest."""
        return round_s(config, self) + ROUND_EXTRA_S


class Rounds(OptionalStage):
    """Every agent on every layout, one round each, with a questionnaire after each.

    [Balance](#balance) tells how rounds are ordered, which agent is met on which layout, and who sits where.
    """

    becomes = (RoundStep, QuestionnaireStep)

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
    show_score: ShowScore = "during"
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
    def meeting(self) -> Lobby:
        """How `human` partners find each other, as written or as usual."""
        return self.lobby or Lobby()

    @property
    def partners(self) -> tuple[str, ...]:
        """The partners, as written."""
        return self.agents

    @property
    def rounds(self) -> int:
        """How many rounds a visit plays in this stage."""
        return len(self.layouts) * (len(self.agents) if self.pairs == "all" else 1)

    def needed(self) -> dict[Counted, int]:
        """How many participants of a cell balance each order that is counted through, by its key."""
        layouts, agents = len(self.layouts), len(self.agents)
        by_agent = self.blocks == "agent"
        units = self.rounds if self.seats == "per_round" else layouts
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

    def steps(self, stage_id: str, draft: Draft) -> Iterator[Step]:
        """Every round in the visit's order, and the questionnaire after it."""
        agents = [draft.resolve(agent) for agent in self.agents]
        rules = self.rules()
        for which, one, seat in self._sequence(draft):
            kitchen, agent = self.layouts[which], agents[one]
            draft.round_no += 1
            title = draft.say("Round {n} of {of}").format(n=draft.round_no, of=draft.of)
            about = {
                "round_no": draft.round_no,
                "human_hat": draft.human_hat,
                "partner_hat": draft.hats[agent],
            }
            played = _played(self, draft, kitchen, agent, seat) | about
            step = RoundStep(
                id=f"{stage_id}-{draft.round_no}",
                title=self.title or title,
                **played,
                **self._goal(draft, kitchen),
                **(self._meeting(stage_id, draft, played) if agent == HUMAN else {}),
                **rules,
            )
            yield step
            if self.after_each is not None:
                title = draft.questions_title(self.after_each)
                asked = draft.questions(self.after_each)
                yield QuestionnaireStep(id=f"{step.id}-questions", title=title, **asked, **about, **rules)

    def _sequence(self, draft: Draft) -> Iterator[tuple[int, int, int]]:
        """(layout, agent, seat) of each round in order, the first two as places in the file."""
        layouts, agents = len(self.layouts), len(self.agents)
        by_layout, by_agent = draft.by(LAYOUTS), draft.by(AGENTS)
        if self.pairs != "all":
            with_agent = spread(self.pairs, agents, layouts, *draft.by(PAIRS))
            order = orders(self.layout_order, layouts, 1, *by_layout)[0]
            rounds = [(layout, with_agent[layout]) for layout in order]
        elif self.blocks == "layout":
            order = orders(self.layout_order, layouts, 1, *by_layout)[0]
            inside = orders(self.agent_order, agents, layouts, *by_agent)
            rounds = [(layout, agent) for n, layout in enumerate(order) for agent in inside[n]]
        else:
            order = orders(self.agent_order, agents, 1, *by_agent)[0]
            inside = orders(self.layout_order, layouts, agents, *by_layout)
            rounds = [(layout, agent) for n, agent in enumerate(order) for layout in inside[n]]
        met = list(dict.fromkeys(layout for layout, _ in rounds))
        per_round = self.seats == "per_round"
        seats = bits(self.seat_order, len(rounds) if per_round else layouts, *draft.by(SEATS))
        for n, (layout, agent) in enumerate(rounds):
            seat = seats[n if per_round else met.index(layout)]
            yield layout, agent, self.seats if isinstance(self.seats, int) else seat

    def _goal(self, draft: Draft, kitchen: Kitchen) -> dict[str, Any]:
        if kitchen.goal is None:
            return {}
        unit = draft.config.bonus_unit
        amount = None if kitchen.bonus is None else f"{kitchen.bonus:g} {unit}".strip()
        text = self.goal_text or (
            draft.say("Reach {goal} points together to meet this kitchen's goal.")
            if amount is None
            else draft.say("Reach {goal} points together to earn the bonus of {bonus}.")
        )
        text = text.replace("{goal}", str(kitchen.goal)).replace("{bonus}", amount or "")
        bonus = None if kitchen.bonus is None else Bonus(amount=kitchen.bonus, unit=unit)
        return {"goal": Goal(score=kitchen.goal, text=text), "bonus": bonus}

    def _meeting(self, stage_id: str, draft: Draft, played: Mapping[str, Any]) -> dict[str, Any]:
        """What the lobby needs; two visits may play together when their `pairing` is the same."""
        same = [played[key] for key in ("round_no", "layout", "ticks", "tick_ms", "episodes", "input_mode")]
        cell = (f"{name}={level}" for name, level in draft.condition.items())
        rules = LobbyRules(
            wait_s=self.meeting.wait_s,
            fallback=draft.resolve(self.meeting.fallback),
            dropout=draft.resolve(self.meeting.dropout),
        )
        return {"lobby": rules, "pairing": "|".join([stage_id, *map(str, same), *cell])}

    def names(self) -> Iterator[tuple[NamedKind, str, Loc]]:
        """The layouts, the agents with those that may step in, the questionnaire."""
        for n, kitchen in enumerate(self.layouts):
            yield "layouts", kitchen.layout, ("layouts", n, "layout")
        for agent, loc in self._agents():
            yield "agents", agent, loc
        if self.after_each is not None:
            yield "questionnaires", self.after_each, ("after_each",)

    def meetings(self) -> Iterator[tuple[str, str, Loc]]:
        """Every agent, those that may step in included, on every layout."""
        for agent, loc in self._agents():
            if agent != HUMAN:
                yield from ((agent, kitchen.layout, loc) for kitchen in self.layouts)

    def _agents(self) -> Iterator[tuple[str, Loc]]:
        yield from ((agent, ("agents", n)) for n, agent in enumerate(self.agents))
        yield from ((agent, ("lobby", key)) for key, agent in self.meeting.agents)

    def description(self, study: Study) -> Iterator[str]:
        """The rounds, their layouts, partners, seats and orders."""
        yield from described_rounds(study, self)

    def seconds(self, config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> float:
        """Countdowns and ticks, and a guess of the rest."""
        after = answer_s(config, questionnaires, self.after_each) if self.after_each else 0.0
        each = self.rounds / len(self.layouts)
        rounds_s = (round_s(config, self, kitchen) for kitchen in self.layouts)
        return sum(each * (seconds + ROUND_EXTRA_S + after) for seconds in rounds_s)


def round_s(config: StudyFile, stage: Tutorial | Rounds, kitchen: Kitchen | None = None) -> float:
    """The length of a round in seconds, its countdown included."""
    ticks = (kitchen and kitchen.horizon_ticks) or stage.horizon_ticks or config.horizon_ticks
    tick_ms = (kitchen and kitchen.tick_ms) or stage.tick_ms or config.tick_ms
    return config.countdown_s + stage.episodes * ticks * tick_ms / 1000


def _played(
    stage: Tutorial | Rounds, draft: Draft, kitchen: Kitchen, agent: str, seat: int
) -> dict[str, Any]:
    """What the step of a round says of how it is played."""
    seeds = draft.round_seeds(stage.episodes)
    config = draft.config
    return {
        "of": draft.of,
        "layout": draft.study.layouts[draft.resolve(kitchen.layout)].name,
        "partner": {HUMAN: "human", ALONE: "none"}.get(agent, "agent"),
        "agent": {HUMAN: None, ALONE: ALONE_AGENT}.get(agent, agent),
        "human_seat": seat,
        "seed": seeds[0],
        "seeds": seeds,
        "episodes": stage.episodes,
        "ticks": kitchen.horizon_ticks or stage.horizon_ticks or config.horizon_ticks,
        "tick_ms": kitchen.tick_ms or stage.tick_ms or config.tick_ms,
        "input_mode": stage.input_mode or config.input_mode,
        "show_score": stage.show_score,
        "skippable": stage.skippable,
    }
