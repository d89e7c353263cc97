"""The plan of one visit: every step a participant will meet, drawn from the visit's seed and its slot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng

from galley.study.study import Study
from galley.study.visit.condition_slots import cell_number, cell_of_slot, place_in_cell
from galley.study.visit.counterbalance import Turn, bits, orders, picks, spread, together
from galley.study.visit.steps import STEP_KINDS, Plan, Step, StepKind, condition_data
from galley.study.written.factors import Counted, resolve
from galley.study.written.item_base import Say
from galley.study.written.languages import Words
from galley.study.written.questionnaire import Questionnaire
from galley.study.written.stages import (
    ALONE,
    HUMAN,
    Break,
    Comparison,
    Consent,
    Debrief,
    Instructions,
    Kitchen,
    Lobby,
    Questions,
    Quiz,
    Rounds,
    ScreenOut,
    Stage,
    Tutorial,
    conditions_of,
    stage_ids,
)
from galley.study.written.study_file import ALONE_AGENT, played_agents

__all__ = ["STEP_KINDS", "Plan", "Step", "StepKind", "plan_visit", "visit_seed"]

DESIGN: Final = 3
HATS, LAYOUTS, AGENTS, SEATS, PAIRS, FIRST, ITEMS = range(7)
"""What is drawn or counted through in a stage; every one has a stream of its own."""
JOINED: Final = 0
KEYS: Final[Mapping[Counted, int]] = {
    "layout_order": LAYOUTS,
    "agent_order": AGENTS,
    "pairs": PAIRS,
    "seat_order": SEATS,
    "hat_order": HATS,
}


def visit_seed(study: Study, visit_no: int) -> int:
    """The seed (below 2**63) of the visit of this number, counted from 0, spawned from the study's seed."""
    return _seed(SeedSequence(study.config.seed, spawn_key=(visit_no,)))


def plan_visit(study: Study, visit_seed: int, visit_no: int, slot: int | None = None, say: Say = str) -> Plan:
    """The plan of a visit: a function of the study, the seed and the slot, whoever asks and whenever.

    The slot (the visit's number if none is given) decides the condition and everything that is counted
    through; the visit's seed decides what is drawn. The seed spawns one sequence for what is drawn (hats,
    orders, seats, items, which partner is asked about first) and one for each round, in the order of the
    rounds, tutorials included. `say` translates the titles of rounds and the line of the goal.
    """
    return _Draft(study, visit_seed, visit_no if slot is None else slot, say).plan(visit_no)


def _seed(sequence: SeedSequence) -> int:
    return int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(1))


class _Draft:
    """A plan in the making: the visit's draws, and the rounds counted so far."""

    def __init__(self, study: Study, seed: int, slot: int, say: Say) -> None:
        self.study = study
        self.config = study.config
        self.seed = seed
        self.slot = slot
        self.say = say
        self.condition = cell_of_slot(study, slot)
        self.cell = cell_number(study, slot)
        self.number = place_in_cell(study, slot)
        self.rounds = sum(s.count for s in self.config.stages if isinstance(s, Rounds) and self._meets(s))
        self.round_no = 0
        self.seeds_drawn = 0
        self.pages = 0
        joined = self.config.joined(self.condition)
        tag = (DESIGN, self.cell, JOINED)
        given = together(self.config.seed, tag, self.number, tuple(joined.values()))
        self.given = {(place, KEYS[key]): one for (place, key), one in zip(joined, given, strict=True)}
        agents = played_agents(self.config.stages, self.condition)
        wanted = self.config.hats_worn(self.condition)
        chosen = picks(self.config.hat_order, len(self.config.hats), wanted, *self._by(0, HATS))
        hats = [str(self.config.hats[place]) for place in chosen]
        self.human_hat = hats[0]
        self.hats = dict(zip(agents, hats[1:], strict=False))
        # The tutorial's partner wears a hat of its own, so that nobody rates a partner by the practice round.
        self.tutorial_hat = hats[-1]

    def plan(self, visit_no: int) -> Plan:
        steps: list[Step] = []
        for place, (stage_id, stage) in enumerate(
            zip(stage_ids(self.config.stages), self.config.stages, strict=True)
        ):
            if self._meets(stage):
                steps += self._steps(place, stage_id, stage)
        return Plan(
            self.study.name,
            self.study.sha256,
            visit_no,
            self.seed,
            dict(self.condition),
            self.hats,
            tuple(steps),
            self.study.language,
            self.slot,
            self.config.attention.model_dump(),
        )

    def _by(self, stage: int, what: int) -> tuple[Generator, Turn]:
        """What an order is drawn with, and what it is counted through with."""
        draw = default_rng(SeedSequence(self.seed, spawn_key=(0, stage, what)))
        tag = (DESIGN, self.cell, stage, what)
        return draw, Turn(self.config.seed, tag, self.number, self.given.get((stage, what)))

    def _meets(self, stage: Stage) -> bool:
        asked = (condition for condition in conditions_of(stage) if condition.factor is not None)
        return all(condition.holds(self.condition[str(condition.factor)]) for condition in asked)

    def _steps(self, place: int, stage_id: str, stage: Stage) -> Iterator[Step]:
        more = _rules_of(stage)
        match stage:
            case Consent() | Instructions():
                yield Step(stage_id, stage.kind, self._title(stage), self._text(stage.text) | more)
            case Break():
                none = {"text": None, "sha256": None}
                title = stage.title or (
                    self.say("Time for a break") if stage.text is None else self._title(stage)
                )
                yield Step(stage_id, "break", title, (self._text(stage.text) if stage.text else none) | more)
            case ScreenOut():
                yield Step(stage_id, "screen_out", stage.title, more)
            case Debrief():
                completion = self.config.completion
                end = {"completion_code": completion.code, "redirect": completion.redirect}
                yield Step(stage_id, "debrief", self._title(stage), self._text(stage.text) | end)
            case Questions():
                yield self._questionnaire(stage_id, stage.title, stage.questionnaire, None, more)
            case Quiz():
                step = self._questionnaire(stage_id, stage.title, stage.questionnaire, None, more)
                text = None if stage.text is None else resolve(stage.text, self.condition)
                rules = {"tries": stage.tries, "after_last": stage.after_last, "text": text}
                yield Step(step.id, "quiz", step.title, step.data | rules)
            case Tutorial():
                yield self._tutorial(place, stage_id, stage, more)
            case Rounds():
                yield from self._rounds(place, stage_id, stage, more)
            case Comparison():
                yield self._comparison(place, stage_id, stage, more)

    def _title(self, stage: Consent | Instructions | Debrief | Break) -> Words:
        return stage.title or self.study.texts[resolve(str(stage.text), self.condition)].title

    def _text(self, name: str) -> dict[str, Any]:
        name = resolve(name, self.condition)
        return {"text": name, "sha256": self.study.texts[name].sha256}

    def _questions(self, name: str) -> dict[str, Any]:
        """The questionnaire of a step: its name, the order of its items in this visit, the right answers."""
        questionnaire = self.study.questionnaires[name]
        self.pages += 1
        draw = default_rng(SeedSequence(self.seed, spawn_key=(0, 0, ITEMS, self.pages)))
        return {
            "questionnaire": name,
            "item_order": item_order(questionnaire, draw),
            "expected": questionnaire.expected,
        }

    def _questionnaire(
        self, step_id: str, title: str, name: str, about: Mapping[str, Any] | None, more: Mapping[str, Any]
    ) -> Step:
        name = resolve(name, self.condition)
        about = about or {"round_no": None, "partner_hat": None, "human_hat": None}
        data = self._questions(name) | {k: about[k] for k in ("round_no", "partner_hat", "human_hat")}
        title = title or self.study.questionnaires[name].title
        return Step(step_id, "questionnaire", title, {**data, **more})

    def _round(
        self, stage: Tutorial | Rounds, kitchen: Kitchen, agent: str, seat: int, hat: str
    ) -> dict[str, Any]:
        self.seeds_drawn += 1
        sequence = SeedSequence(self.seed, spawn_key=(self.seeds_drawn,))
        seeds = [_seed(sequence), *(_seed(child) for child in sequence.spawn(stage.episodes - 1))]
        partner = {HUMAN: "human", ALONE: "none"}.get(agent, "agent")
        return {
            "round_no": self.round_no,
            "of": self.rounds,
            "layout": self.study.layouts[resolve(kitchen.layout, self.condition)].name,
            "partner": partner,
            "agent": {"human": None, "none": ALONE_AGENT}.get(partner, agent),
            "human_seat": seat,
            "human_hat": self.human_hat,
            "partner_hat": hat,
            "seed": seeds[0],
            "seeds": seeds,
            "episodes": stage.episodes,
            "ticks": kitchen.horizon_ticks or stage.horizon_ticks or self.config.horizon_ticks,
            "tick_ms": kitchen.tick_ms or stage.tick_ms or self.config.tick_ms,
            "input_mode": stage.input_mode or self.config.input_mode,
            "show_score": stage.show_score,
            "goal": None,
            "bonus": None,
            "tutorial": False,
            "scored": True,
            "skippable": stage.skippable,
        }

    def _tutorial(self, place: int, step_id: str, stage: Tutorial, more: dict[str, Any]) -> Step:
        draw = self._by(place, SEATS)[0]
        seat = int(draw.integers(2)) if stage.seat == "random" else stage.seat
        agent = resolve(stage.agent, self.condition)
        kitchen = Kitchen(layout=stage.layout)
        played = {"round_no": 0, "tutorial": True, "scored": False}
        data = self._round(stage, kitchen, agent, seat, self.tutorial_hat) | played | more
        return Step(step_id, "round", stage.title or self.say("Practice round"), data)

    def _rounds(self, place: int, stage_id: str, stage: Rounds, more: dict[str, Any]) -> Iterator[Step]:
        agents = [resolve(agent, self.condition) for agent in stage.agents]
        for which, one, seat in self._sequence(place, stage):
            kitchen, agent = stage.layouts[which], agents[one]
            self.round_no += 1
            data = self._round(stage, kitchen, agent, seat, self.hats[agent]) | more
            data |= self._goal(stage, kitchen)
            if agent == HUMAN:
                data |= self._meeting(stage_id, stage, data)
            step_id = f"{stage_id}-{self.round_no}"
            title = self.say("Round {n} of {of}").format(n=self.round_no, of=self.rounds)
            yield Step(step_id, "round", stage.title or title, data)
            if stage.after_each is not None:
                about = {key: value for key, value in more.items() if key == "when"}
                yield self._questionnaire(f"{step_id}-questions", "", stage.after_each, data, about)

    def _sequence(self, place: int, stage: Rounds) -> Iterator[tuple[int, int, int]]:
        """(layout, agent, seat) of each round in order, the first two as places in the file."""
        layouts, agents = len(stage.layouts), len(stage.agents)
        by_layout, by_agent = self._by(place, LAYOUTS), self._by(place, AGENTS)
        if stage.pairs != "all":
            with_agent = spread(stage.pairs, agents, layouts, *self._by(place, PAIRS))
            order = orders(stage.layout_order, layouts, 1, *by_layout)[0]
            rounds = [(layout, with_agent[layout]) for layout in order]
        elif stage.blocks == "layout":
            order = orders(stage.layout_order, layouts, 1, *by_layout)[0]
            inside = orders(stage.agent_order, agents, layouts, *by_agent)
            rounds = [(layout, agent) for n, layout in enumerate(order) for agent in inside[n]]
        else:
            order = orders(stage.agent_order, agents, 1, *by_agent)[0]
            inside = orders(stage.layout_order, layouts, agents, *by_layout)
            rounds = [(layout, agent) for n, agent in enumerate(order) for layout in inside[n]]
        met = list(dict.fromkeys(layout for layout, _ in rounds))
        per_round = stage.seats == "per_round"
        seats = bits(stage.seat_order, len(rounds) if per_round else layouts, *self._by(place, SEATS))
        for n, (layout, agent) in enumerate(rounds):
            seat = seats[n if per_round else met.index(layout)]
            yield layout, agent, stage.seats if isinstance(stage.seats, int) else seat

    def _goal(self, stage: Rounds, kitchen: Kitchen) -> dict[str, Any]:
        if kitchen.goal is None:
            return {}
        amount = None if kitchen.bonus is None else f"{kitchen.bonus:g} {self.config.bonus_unit}".strip()
        text = stage.goal_text or (
            self.say("Reach {goal} points together to meet this kitchen's goal.")
            if amount is None
            else self.say("Reach {goal} points together to earn the bonus of {bonus}.")
        )
        text = text.replace("{goal}", str(kitchen.goal)).replace("{bonus}", amount or "")
        bonus = None if amount is None else {"amount": kitchen.bonus, "unit": self.config.bonus_unit}
        return {"goal": {"score": kitchen.goal, "text": text}, "bonus": bonus}

    def _meeting(self, stage_id: str, stage: Rounds, data: Mapping[str, Any]) -> dict[str, Any]:
        """What the lobby needs; two visits may play together when their `pairing` is the same."""
        lobby = stage.lobby or Lobby()
        same = [data[key] for key in ("round_no", "layout", "ticks", "tick_ms", "episodes", "input_mode")]
        cell = (f"{name}={level}" for name, level in self.condition.items())
        pairing = "|".join([stage_id, *map(str, same), *cell])
        steps_in = {
            "wait_s": lobby.wait_s,
            "fallback": resolve(lobby.fallback, self.condition),
            "dropout": resolve(lobby.dropout, self.condition),
        }
        return {"lobby": steps_in, "pairing": pairing}

    def _comparison(self, place: int, step_id: str, stage: Comparison, more: Mapping[str, Any]) -> Step:
        agents = [resolve(agent, self.condition) for agent in stage.agents or tuple(self.hats)[:2]]
        first, second = (agents[i] for i in self._by(place, FIRST)[0].permutation(2))
        name = resolve(stage.questionnaire, self.condition)
        data = self._questions(name) | {
            "human_hat": self.human_hat,
            "first": {"hat": self.hats[first], "agent": first},
            "second": {"hat": self.hats[second], "agent": second},
        }
        title = stage.title or self.study.questionnaires[name].title
        return Step(step_id, "comparison", title, {**data, **more})


def item_order(questionnaire: Questionnaire, draw: Generator) -> list[str]:
    """The ids of the items as shown; an item that depends on another one stays behind it in any order."""
    groups: dict[str, list[str]] = {}
    head: dict[str, str] = {}
    for item in questionnaire.items:
        head[item.id] = item.id if item.when is None else head[item.when.item]
        groups.setdefault(head[item.id], []).append(item.id)
    together = list(groups.values())
    if questionnaire.order == "random":
        together = [together[place] for place in draw.permutation(len(together))]
    return [name for group in together for name in group]


def _rules_of(stage: Stage) -> dict[str, Any]:
    """What a stage's steps say of skipping, time and conditions; only what is not as usual."""
    rules: dict[str, Any] = {}
    when = condition_data(conditions_of(stage))
    if when:
        rules["when"] = when
    for key, usual in (("skippable", False), ("time_limit_s", None), ("at_least_s", 0)):
        value = getattr(stage, key, usual)
        if value != usual:
            rules[key] = value
    if "time_limit_s" in rules:
        rules["at_limit"] = getattr(stage, "at_limit", "go_on")
    return rules
