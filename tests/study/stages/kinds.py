"""What every kind of stage should do, written out once more: one row per kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from galley.outcomes import VisitOutcome
from galley.study.visit.happenings import (
    Agreed,
    Continued,
    Declined,
    Happening,
    RoundEnded,
    Submitted,
)

ROUND = {
    "of": 2,
    "layout": "cramped_room",
    "partner": "agent",
    "human_hat": "orange",
    "episodes": 1,
    "ticks": 400,
    "tick_ms": 150,
    "input_mode": "hold",
    "show_score": "during",
    "goal": None,
    "bonus": None,
}


def rounds_end(step_id: str, *, skippable: bool = False) -> list[Happening]:
    ended: list[Happening] = [RoundEnded(step_id, "finished"), RoundEnded(step_id, "abandoned")]
    return [*ended, RoundEnded(step_id, "skipped")] if skippable else ended


@dataclass(frozen=True)
class Kind:
    """A stage as a study file writes it, behind two rounds, and what has to come of its first step.

    `stored` is what a plan holds of the step besides seeds and hashes, `tells` the stage's first line in a
    description. `ends` are the happenings that end the step, `forms` what forms of its page mean.
    """

    line: str
    step: str
    stored: Mapping[str, Any]
    seconds: float
    tells: str
    ends: Callable[[str], list[Happening]] = lambda step_id: []
    forms: tuple[tuple[dict[str, list[str]], type[Happening] | None], ...] = (({}, None),)
    ends_visit_as: VisitOutcome | None = None
    page: Mapping[str, Any] = field(default_factory=dict)
    """What its page is given, as far as that is no text and no questionnaire."""


CONSENT = Kind(
    "{kind: consent, text: consent}",
    "consent",
    {"text": "consent"},
    60,
    "text 'Before you take part'",
    lambda step_id: [Agreed(step_id), Declined(step_id)],
    (
        ({"choice": ["agree"]}, Agreed),
        ({"choice": ["decline"]}, Declined),
        ({"choice": ["maybe"]}, None),
        ({}, None),
    ),
)
DEBRIEF = Kind(
    "{kind: debrief, text: debrief}",
    "debrief",
    {"text": "debrief", "completion_code": "DONE", "redirect": None},
    20,
    "text 'Thank you for cooking'",
    ends_visit_as="completed",
)
ASKED = {"questionnaire": "kitchen-quiz", "item_order": ["onions", "start", "score"]}
RIGHT = {"onions": 3, "start": "by-itself", "score": "shared"}
NO_ROUND = {"round_no": None, "partner_hat": None, "human_hat": None}

PAGE_OF_ROUND = {
    key: ROUND[key]
    for key in ("goal", "bonus", "human_hat", "partner", "episodes", "show_score", "input_mode")
}

KINDS: dict[str, Kind] = {
    "consent": CONSENT,
    "questionnaire": Kind(
        "{kind: questionnaire, questionnaire: kitchen-quiz, time_limit_s: 15, at_limit: end}",
        "questionnaire",
        {**ASKED, "expected": RIGHT, **NO_ROUND, "time_limit_s": 15, "at_limit": "end"},
        15,
        "questionnaire 'Before you cook', 3 items",
        lambda step_id: [Submitted(step_id)],
        (({}, Submitted),),
        page=NO_ROUND,
    ),
    "instructions": Kind(
        "{kind: instructions, text: instructions, at_least_s: 5}",
        "instructions",
        {"text": "instructions", "at_least_s": 5},
        90,
        "text 'How to cook'",
        lambda step_id: [Continued(step_id)],
        (({}, Continued),),
    ),
    "quiz": Kind(
        "{kind: quiz, questionnaire: kitchen-quiz, tries: 2, text: instructions}",
        "quiz",
        {**ASKED, "expected": RIGHT, **NO_ROUND, "tries": 2, "after_last": "end", "text": "instructions"},
        18,
        "questionnaire 'Before you cook', 3 items, 2 tries, then the visit ends",
        lambda step_id: [Submitted(step_id)],
        (({}, Submitted),),
        page=NO_ROUND,
    ),
    "break": Kind(
        "{kind: break, skippable: true, time_limit_s: 30}",
        "break",
        {"text": None, "skippable": True, "time_limit_s": 30, "at_limit": "go_on"},
        30,
        "a break",
        lambda step_id: [Continued(step_id)],
        (({}, Continued),),
    ),
    "screen_out": Kind(
        "{kind: screen_out, when: {item: first.age, at_most: 17}}",
        "screen_out",
        {"when": [{"item": "first.age", "at_most": 17}]},
        0,
        "ends the visit as screened out",
        ends_visit_as="screened_out",
    ),
    "tutorial": Kind(
        "{kind: tutorial, layout: cramped_room, agent: stay, seat: 0, skippable: true}",
        "round",
        {
            **ROUND,
            "round_no": 0,
            "agent": "stay",
            "human_seat": 0,
            "partner_hat": "yellow",
            "tutorial": True,
            "scored": False,
            "skippable": True,
        },
        71,
        "cramped_room with stay, 60 s",
        lambda step_id: rounds_end(step_id, skippable=True),
        page={
            **PAGE_OF_ROUND,
            "round_no": 0,
            "of": 2,
            "partner_hat": "yellow",
            "tutorial": True,
            "skippable": True,
        },
    ),
    "rounds": Kind(
        "{kind: rounds, agents: [random], seats: 1, layouts: [{layout: cramped_room}]}",
        "round",
        {
            **ROUND,
            "round_no": 3,
            "of": 3,
            "agent": "random",
            "human_seat": 1,
            "partner_hat": "sky-blue",
            "tutorial": False,
            "scored": True,
            "skippable": False,
        },
        71,
        "1 rounds of 60 s (400 ticks)",
        rounds_end,
        page={
            **PAGE_OF_ROUND,
            "round_no": 3,
            "of": 3,
            "partner_hat": "sky-blue",
            "tutorial": False,
            "skippable": False,
        },
    ),
    "comparison": Kind(
        "{kind: comparison, questionnaire: comparison, agents: [random, myopic]}",
        "comparison",
        {
            "questionnaire": "comparison",
            "item_order": ["fluency", "preference", "understanding"],
            "expected": {},
            "human_hat": "orange",
            "first": {"hat": "sky-blue", "agent": "random"},
            "second": {"hat": "bluish-green", "agent": "myopic"},
        },
        18,
        "questionnaire 'Your two partners', 3 items, comparing random and myopic",
        lambda step_id: [Submitted(step_id)],
        (({}, Submitted),),
        page={"human_hat": "orange", "first": {"hat": "sky-blue"}, "second": {"hat": "bluish-green"}},
    ),
    "debrief": DEBRIEF,
}
