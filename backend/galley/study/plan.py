"""The plan of one visit: every step a participant will meet, drawn from the visit's seed."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal, get_args

import numpy as np

from galley.study.config import (
    Comparison,
    Consent,
    Debrief,
    Instructions,
    Questions,
    Rounds,
    Tutorial,
    played_agents,
    stage_ids,
)
from galley.study.study import Study

StepKind = Literal["consent", "questionnaire", "instructions", "round", "comparison", "debrief"]
STEP_KINDS: Final[tuple[StepKind, ...]] = get_args(StepKind)

TUTORIAL_TITLE = "Practice round"


@dataclass(frozen=True)
class Step:
    """One screen of a visit; `data` is plain JSON. Agent names in it are for the server alone."""

    id: str
    kind: StepKind
    title: str
    data: dict[str, Any]


@dataclass(frozen=True)
class Plan:
    """What one visit will meet; `hats` maps each compared agent to its hat colour in this visit."""

    study: str
    study_sha256: str
    visit_no: int
    visit_seed: int
    condition: dict[str, Any]
    hats: dict[str, str]
    steps: tuple[Step, ...]

    def to_json(self) -> str:
        """The plan as one line of JSON."""
        return json.dumps(asdict(self), ensure_ascii=False, separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> Plan:
        """The plan that `to_json` wrote, equal to it."""
        fields = json.loads(text)
        return cls(**{**fields, "steps": tuple(Step(**step) for step in fields["steps"])})


def visit_seed(study: Study, visit_no: int) -> int:
    """The seed (below 2**63) of the visit of this number, counted from 0, spawned from the study's seed."""
    return _seed(np.random.SeedSequence(study.config.seed, spawn_key=(visit_no,)))


def plan_visit(study: Study, visit_seed: int, visit_no: int) -> Plan:
    """The plan of a visit: a function of the study and the seed, whoever asks and whenever.

    The visit's seed spawns one sequence for what is drawn (hats, orders, seats, which partner is asked about
    first) and one for each round, in the order of the rounds, tutorials included.
    """
    return _Draft(study, visit_seed).plan(visit_no)


def _seed(sequence: np.random.SeedSequence) -> int:
    return int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(1))


class _Draft:
    """A plan in the making: the visit's draws, and the rounds counted so far."""

    def __init__(self, study: Study, seed: int) -> None:
        self.study = study
        self.config = study.config
        self.seed = seed
        self.sequence = np.random.SeedSequence(seed)
        self.draw = np.random.default_rng(self.sequence.spawn(1)[0])
        self.rounds = sum(len(s.agents) * len(s.layouts) for s in self.config.stages if isinstance(s, Rounds))
        self.round_no = 0
        agents = played_agents(self.config.stages)
        human, *others = (str(hat) for hat in self.draw.permutation(self.config.hats))
        self.human_hat = human
        self.hats = dict(zip(agents, others, strict=False))
        # The tutorial's partner wears a hat of its own, so that nobody rates a partner by the practice round.
        self.tutorial_hat = others[len(agents)] if len(others) > len(agents) else human

    def plan(self, visit_no: int) -> Plan:
        steps: list[Step] = []
        for stage_id, stage in zip(stage_ids(self.config.stages), self.config.stages, strict=True):
            match stage:
                case Consent() | Instructions():
                    steps.append(Step(stage_id, stage.kind, self._title(stage), self._text(stage.text)))
                case Debrief():
                    completion = self.config.completion
                    end = {"completion_code": completion.code, "redirect": completion.redirect}
                    data = {**self._text(stage.text), **end}
                    steps.append(Step(stage_id, stage.kind, self._title(stage), data))
                case Questions():
                    steps.append(self._questionnaire(stage_id, stage.title, stage.questionnaire, None))
                case Tutorial():
                    steps.append(self._tutorial(stage_id, stage))
                case Rounds():
                    steps += self._rounds(stage_id, stage)
                case Comparison():
                    steps.append(self._comparison(stage_id, stage))
        return Plan(self.study.name, self.study.sha256, visit_no, self.seed, {}, self.hats, tuple(steps))

    def _title(self, stage: Consent | Instructions | Debrief) -> str:
        return stage.title or self.study.texts[stage.text].title

    def _text(self, name: str) -> dict[str, Any]:
        return {"text": name, "sha256": self.study.texts[name].sha256}

    def _questionnaire(self, step_id: str, title: str, name: str, about: Mapping[str, Any] | None) -> Step:
        about = about or {"round_no": None, "partner_hat": None, "human_hat": None}
        data = {"questionnaire": name, **{k: about[k] for k in ("round_no", "partner_hat", "human_hat")}}
        return Step(step_id, "questionnaire", title or self.study.questionnaires[name].title, data)

    def _round(self, layout: str, agent: str, seat: int, hat: str) -> dict[str, Any]:
        return {
            "round_no": self.round_no,
            "of": self.rounds,
            "layout": self.study.layouts[layout].name,
            "agent": agent,
            "human_seat": seat,
            "human_hat": self.human_hat,
            "partner_hat": hat,
            "seed": _seed(self.sequence.spawn(1)[0]),
            "ticks": self.config.horizon_ticks,
            "tick_ms": self.config.tick_ms,
            "goal": None,
            "tutorial": False,
            "scored": True,
            "skippable": False,
        }

    def _tutorial(self, step_id: str, stage: Tutorial) -> Step:
        seat = int(self.draw.integers(2)) if stage.seat == "random" else stage.seat
        data = self._round(stage.layout, stage.agent, seat, self.tutorial_hat) | {
            "round_no": 0,
            "ticks": stage.horizon_ticks or self.config.horizon_ticks,
            "tutorial": True,
            "scored": False,
            "skippable": stage.skippable,
        }
        return Step(step_id, "round", stage.title or TUTORIAL_TITLE, data)

    def _rounds(self, stage_id: str, stage: Rounds) -> Iterator[Step]:
        for kitchen in stage.layouts:
            agents = list(stage.agents)
            if stage.agent_order == "random":
                agents = [stage.agents[i] for i in self.draw.permutation(len(agents))]
            layout_seat = int(self.draw.integers(2))
            for agent in agents:
                round_seat = int(self.draw.integers(2))
                seat = {"per_layout": layout_seat, "per_round": round_seat}.get(str(stage.seats))
                self.round_no += 1
                data = self._round(
                    kitchen.layout, agent, int(stage.seats) if seat is None else seat, self.hats[agent]
                )
                if kitchen.goal is not None:
                    text = stage.goal_text.replace("{goal}", str(kitchen.goal))
                    data["goal"] = {"score": kitchen.goal, "text": text}
                step_id = f"{stage_id}-{self.round_no}"
                yield Step(step_id, "round", stage.title or f"Round {self.round_no} of {self.rounds}", data)
                if stage.after_each is not None:
                    yield self._questionnaire(f"{step_id}-questions", "", stage.after_each, data)

    def _comparison(self, step_id: str, stage: Comparison) -> Step:
        agents = stage.agents or tuple(self.hats)[:2]
        first, second = (agents[i] for i in self.draw.permutation(2))
        data = {
            "questionnaire": stage.questionnaire,
            "human_hat": self.human_hat,
            "first": {"hat": self.hats[first], "agent": first},
            "second": {"hat": self.hats[second], "agent": second},
        }
        title = stage.title or self.study.questionnaires[stage.questionnaire].title
        return Step(step_id, "comparison", title, data)
