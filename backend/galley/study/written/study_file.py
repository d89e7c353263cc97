"""What a study file says, before anyone visits: settings, factors, and stages in order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from math import prod
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from galley.files.reading import FileModel, Loc, faults
from galley.names import name_fix
from galley.study.stages.round_step import InputMode
from galley.study.stages.rounds import Rounds, TickMs, Ticks, Tutorial
from galley.study.stages.stage import NamedKind, Stage, stage_ids
from galley.study.stages.stage_kinds import AnyStage, Comparison, Consent, Debrief
from galley.study.visit.counterbalance import MOST_SEQUENCES, permutations_count, sequences
from galley.study.written.factors import (
    FACTOR_MARK,
    Counted,
    Factor,
    FactorName,
    Order,
    levels_of,
    names_differ,
    resolve,
)
from galley.study.written.hats import HATS, Hat
from galley.study.written.languages import LanguageCode, Text, Words
from galley.study.written.recruitment import Attention, Completion, Endings, Recruitment, unknown_places

MOST_CELLS: Final = 1000
Fault = tuple[Loc, str, str]
Named = tuple[NamedKind, str, Loc]
"""(kind of thing in the workspace, name, place in the file)."""


class StudyFile(FileModel):
    """A study file. Times are in ticks of `tick_ms` milliseconds or in seconds, as their names say."""

    format: Literal[1]
    """Version of this kind of file."""
    title: Text
    """What participants see first."""
    about: Words = ""
    """One line under the title."""
    languages: tuple[LanguageCode, ...] = Field(("en",), min_length=1, max_length=20)
    """Codes of the languages that participants may choose from; the first is the study's own."""
    seed: int = Field(ge=0, lt=2**63)
    """A whole number; all that is drawn follows from it."""
    minutes: int | None = Field(None, ge=1, le=600)
    """How long a visit takes, as told to participants; estimated without it."""
    tick_ms: TickMs = 150
    """Milliseconds per tick."""
    horizon_ticks: Ticks = 400
    """Ticks of an episode: 400 of 150 ms are one minute."""
    input_mode: InputMode = "hold"
    """A held key acts at every tick, or every press of a key is one action."""
    countdown_s: Annotated[int, Field(ge=0, le=30)] = 3
    """Seconds between Start and the first tick."""
    abandon_after_s: Annotated[int, Field(ge=1, le=3600)] = 60
    """Seconds after which a round that its participant left ends as abandoned."""
    visit_limit_min: int | None = Field(None, ge=1, le=10_000)
    """Minutes after which a visit ends as timed_out, wherever it is; a round in play is played to its end."""
    hats: tuple[Hat, ...] = HATS
    """The hat colours to give out."""
    hat_order: Order = "random"
    """How hats are given: see Balance."""
    together: tuple[Counted, ...] = Field((), max_length=5)
    """Orders that are counted through together, so that every combination of them comes equally often."""
    bonus_unit: Annotated[str, Field(max_length=20)] = ""
    """The unit of bonuses, such as CNY."""
    factors: dict[FactorName, Factor] = Field(default_factory=dict)
    """What differs between participants, by name: see Balance."""
    quota: int | None = Field(None, ge=1, le=100_000)
    """Completed visits wanted in each cell; then the study closes."""
    slot_expires_min: int = Field(60, ge=1, le=100_000)
    """Minutes without a sign of life after which a visit's slot may be given to someone else."""
    attention: Attention = Attention()
    """What failed attention checks lead to."""
    recruitment: Recruitment = Recruitment()
    """Where participants come from."""
    completion: Completion
    """What those who reach the end take away."""
    endings: Endings = Endings()
    """What those take away who do not."""
    stages: tuple[AnyStage, ...] = Field(min_length=2)
    """The stages in order; consent first, debrief last."""

    @field_validator("hats")
    @classmethod
    def _hats_differ(cls, hats: tuple[Hat, ...]) -> tuple[Hat, ...]:
        return names_differ(hats, "hat")

    @field_validator("together")
    @classmethod
    def _orders_differ(cls, together: tuple[Counted, ...]) -> tuple[Counted, ...]:
        return names_differ(together, "order")

    @field_validator("languages")
    @classmethod
    def _languages_differ(cls, languages: tuple[str, ...]) -> tuple[str, ...]:
        return names_differ(languages, "language")

    @field_validator("factors")
    @classmethod
    def _factors_can_be_crossed(cls, factors: dict[str, Factor]) -> dict[str, Factor]:
        found = list(_factor_faults(factors))
        if found:
            raise faults(found)
        return factors

    @field_validator("stages")
    @classmethod
    def _stages_fit_together(cls, stages: tuple[AnyStage, ...]) -> tuple[AnyStage, ...]:
        found = [*_order_faults(stages), *_id_faults(stages), *_comparison_faults(stages)]
        if found:
            raise faults(found)
        return stages

    @model_validator(mode="after")
    def _parts_fit_together(self, info: ValidationInfo) -> Self:
        found = [*self._factor_name_faults(info.context or {}), *self._redirect_faults()]
        if not found:
            found = [*self._partner_faults(), *self._hat_faults(), *self._together_faults()]
        if found:
            raise faults(found)
        return self

    def conditions(self) -> tuple[dict[str, str], ...]:
        """Every combination of the factors' levels."""
        levels = [factor.levels for factor in self.factors.values()]
        return tuple(dict(zip(self.factors, chosen, strict=True)) for chosen in product(*levels))

    def counters(self, condition: Mapping[str, str]) -> dict[tuple[int, Counted], int]:
        """How many treatments each order has that is counted through, by (place of its stage, key).

        Hats belong to the whole study, so they have the place 0 of consent, which has no orders.
        """
        found: dict[tuple[int, Counted], int] = {}
        for place, stage in enumerate(self.stages):
            found |= {(place, key): count for key, count in stage.needed().items()}
        worn = self.hats_worn(condition)
        hats = {"latin_square": sequences("latin_square", len(self.hats), 1)}
        hats["full"] = permutations_count(len(self.hats), worn)
        if hats.get(self.hat_order, 0) > 1:
            found[0, "hat_order"] = hats[self.hat_order]
        return found

    def joined(self, condition: Mapping[str, str]) -> dict[tuple[int, Counted], int]:
        """Those of the counters that are counted through together, as `together` names them."""
        counters = self.counters(condition)
        return {key: counters[key] for name in self.together for key in sorted(counters) if key[1] == name}

    def hats_worn(self, condition: Mapping[str, str]) -> int:
        """Hats for a participant, their partners and the tutorial's partner, as far as there are so many."""
        return min(len(self.hats), len(self.partners(condition)) + 2)

    def partners(self, condition: Mapping[str, str]) -> tuple[str, ...]:
        """The partners of all rounds in a condition, each once, in the order they are first named."""
        return tuple(dict.fromkeys(resolve(agent, condition) for agent in partners_as_written(self.stages)))

    def _together_faults(self) -> Iterator[Fault]:
        if not self.together:
            return
        condition = self.conditions()[0]
        there = {key for _, key in self.counters(condition)}
        for n, key in enumerate(self.together):
            if key not in there:
                where = "" if key == "hat_order" else "in a rounds stage, "
                fix = f"write `{key}: latin_square` or `{key}: full` {where}or remove it here"
                yield ("together", n), f"nothing counts through '{key}'", fix
        if there.issuperset(self.together) and len(self.joined(condition)) < 2:
            yield ("together",), "one order alone is not counted with another", "name two or more orders"
        count = max(prod(self.joined(condition).values()) for condition in self.conditions())
        if count > MOST_SEQUENCES:
            told = f"these orders have {count} combinations, for so many participants in every cell"
            fix = f"name fewer, or use latin_square instead of full (at most {MOST_SEQUENCES})"
            yield ("together",), told, fix

    def _factor_name_faults(self, known: Mapping[str, tuple[str, ...]]) -> Iterator[Fault]:
        for kind, name, loc in named_in(self.stages):
            factor = name.removeprefix(FACTOR_MARK)
            if factor == name:
                continue
            if factor not in self.factors:
                yield loc, f"no factor is named '{factor}'", name_fix(factor, self.factors)
                continue
            for n, level in enumerate(self.factors[factor].levels):
                if kind in known and level not in known[kind]:
                    told = f"level '{level}' stands for one of {kind}, and none has that name"
                    yield ("factors", factor, "levels", n), told, name_fix(level, known[kind])
        for place, stage in enumerate(self.stages):
            for n, condition in enumerate(stage.conditions):
                if condition.factor is None:
                    continue
                loc = ("stages", place, "when", n)
                if condition.factor not in self.factors:
                    fix = name_fix(condition.factor, self.factors)
                    yield (*loc, "factor"), f"no factor is named '{condition.factor}'", fix
                    continue
                levels = self.factors[condition.factor].levels
                for key in ("any_of", "none_of"):
                    for level in getattr(condition, key):
                        if level not in levels:
                            told = f"'{level}' is no level of '{condition.factor}'"
                            yield (*loc, key), told, f"use one of {' '.join(levels)}"

    def _redirect_faults(self) -> Iterator[Fault]:
        endings = {("completion",): self.completion.redirect} | {
            ("endings", name): getattr(self.endings, name).redirect for name in Endings.model_fields
        }
        for loc, redirect in endings.items():
            for name in unknown_places(redirect, self.recruitment.keep):
                told = f"'{{{name}}}' in the address is no parameter that is kept"
                yield (*loc, "redirect"), told, name_fix(name, ("code", *self.recruitment.keep))

    def _partner_faults(self) -> Iterator[Fault]:
        """Partners who turn out to be the same one in some condition."""
        for condition in self.conditions():
            for place, stage in enumerate(self.stages):
                if not isinstance(stage, (Rounds, Comparison)) or stage.agents is None:
                    continue
                agents = [resolve(agent, condition) for agent in stage.agents]
                if len(set(agents)) < len(agents) and len(set(stage.agents)) == len(stage.agents):
                    told = f"agent '{max(agents, key=agents.count)}' is met twice where {_told(condition)}"
                    yield ("stages", place, "agents"), told, "remove it from the levels of the factor"
                    return

    def _hat_faults(self) -> Iterator[Fault]:
        tutorials = any(isinstance(stage, Tutorial) for stage in self.stages)
        wanted = 1 + max(len(self.partners(c)) for c in self.conditions()) + tutorials
        if len(self.hats) < wanted:
            told = f"{len(self.hats)} hats for a participant, their partners and the tutorial's partner"
            yield ("hats",), told, f"name {wanted} or more of {' '.join(HATS)}"


def named_in(stages: Iterable[Stage]) -> Iterator[Named]:
    """Everything that the stages name, in order; a name may be a `$factor`."""
    for place, stage in enumerate(stages):
        for kind, name, loc in stage.names():
            yield kind, name, ("stages", place, *loc)


def names_of(config: StudyFile, kind: str) -> tuple[str, ...]:
    """All names of one kind that a visit to the study may need, each once, factors resolved."""
    found = [
        name
        for what, written, _ in named_in(config.stages)
        if what == kind
        for name in levels_of(written, config.factors)
    ]
    if kind == "texts":
        endings = (getattr(config.endings, name).text for name in Endings.model_fields)
        found += [text for text in endings if text is not None]
    return tuple(dict.fromkeys(found))


def _told(condition: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} is {level}" for name, level in condition.items())


def _factor_faults(factors: Mapping[str, Factor]) -> Iterator[Fault]:
    full = [factor for factor in factors.values() if factor.assign == "full"]
    count = 1
    for factor in factors.values():
        count *= len(factor.levels)
    if count > MOST_CELLS:
        yield (), f"the factors make {count} combinations", f"keep to {MOST_CELLS}"
    for name, factor in factors.items():
        if factor.assign == "latin_square" and (
            len(full) < 2 or any(len(other.levels) != len(factor.levels) for other in full)
        ):
            told = f"factor '{name}' cannot form a Latin square with the full factors"
            fix = f"cross two or more full factors of {len(factor.levels)} levels each, or use `assign: full`"
            yield (name, "assign"), told, fix


def _order_faults(stages: Sequence[Stage]) -> Iterator[Fault]:
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


def _id_faults(stages: Sequence[Stage]) -> Iterator[Fault]:
    ids = stage_ids(stages)
    for place, stage_id in enumerate(ids):
        if stage_id in ids[:place]:
            yield (place, "id"), f"stage id '{stage_id}' stands twice", "give each stage its own id"


def _comparison_faults(stages: Sequence[Stage]) -> Iterator[Fault]:
    for place, stage in enumerate(stages):
        if not isinstance(stage, Comparison):
            continue
        met = partners_as_written(stages[:place])
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


def partners_as_written(stages: Iterable[Stage]) -> tuple[str, ...]:
    """The partners of all rounds as the file writes them, each once."""
    return tuple(dict.fromkeys(agent for stage in stages for agent in stage.partners))
