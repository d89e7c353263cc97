"""The plan of one visit: every step a participant will meet, drawn from the visit's seed and its slot."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

from numpy.random import SeedSequence

from galley.study.stages.stage import stage_ids
from galley.study.stages.stage_kinds import STEP_TYPES
from galley.study.study import Study
from galley.study.visit.draft import Draft, seed_of
from galley.study.visit.steps import Step
from galley.study.written.item_base import Say
from galley.study.written.recruitment import Attention


@dataclass(frozen=True)
class Plan:
    """What one visit will meet; `hats` maps each partner to its hat colour in this visit.

    `condition` is the level of each factor, given by the `slot`.
    """

    study: str
    study_sha256: str
    visit_no: int
    visit_seed: int
    condition: dict[str, Any]
    hats: dict[str, str]
    steps: tuple[Step, ...]
    language: str = "en"
    slot: int = 0
    attention: Attention = field(default_factory=Attention)

    def to_json(self) -> str:
        """The plan as one line of JSON."""
        parts = {"steps": [step.stored() for step in self.steps], "attention": self.attention.model_dump()}
        return json.dumps(vars(self) | parts, ensure_ascii=False, separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> Plan:
        """The plan that `to_json` wrote, equal to it, or that an older version wrote.

        Raises:
            ValueError: the text is no plan.
        """
        fields = json.loads(text)
        if "attention" in fields:
            fields["attention"] = Attention.model_validate(fields["attention"])
        return cls(**{**fields, "steps": tuple(map(_step, fields["steps"]))})


def _step(stored: dict[str, Any]) -> Step:
    """A step as `Step.stored` gave it."""
    kind = STEP_TYPES.get(stored["kind"])
    if kind is None:
        raise ValueError(f"no step is of kind '{stored['kind']}'; the plan is of a newer version of Galley")
    return kind.model_validate({"id": stored["id"], "title": stored["title"], **stored["data"]})


def visit_seed(study: Study, visit_no: int) -> int:
    """The seed (below 2**63) of the visit of this number, counted from 0, spawned from the study's seed."""
    return seed_of(SeedSequence(study.config.seed, spawn_key=(visit_no,)))


def plan_visit(study: Study, visit_seed: int, visit_no: int, slot: int | None = None, say: Say = str) -> Plan:
    """The plan of a visit: a function of the study, the seed and the slot, whoever asks and whenever.

    The slot (the visit's number if none is given) decides the condition and everything that is counted
    through; the visit's seed decides what is drawn. The seed spawns one sequence for what is drawn (hats,
    orders, seats, items, which partner is asked about first) and one for each round, in the order of the
    rounds, tutorials included. `say` translates the titles of rounds and the line of the goal.
    """
    draft = Draft(study, visit_seed, visit_no if slot is None else slot, say)
    stages = study.config.stages
    steps: list[Step] = []
    for draft.place, (stage_id, stage) in enumerate(zip(stage_ids(stages), stages, strict=True)):
        if stage.meets(draft.condition):
            steps += stage.steps(stage_id, draft)
    return Plan(
        study.name,
        study.sha256,
        visit_no,
        visit_seed,
        draft.condition,
        draft.hats,
        tuple(steps),
        study.language,
        draft.slot,
        study.config.attention,
    )
