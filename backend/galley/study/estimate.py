"""How long a visit takes, guessed from its stages, and the numbers that texts may quote."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from galley.study.written.factors import levels_of
from galley.study.written.questionnaire import Questionnaire
from galley.study.written.stages import (
    Break,
    Comparison,
    Consent,
    Debrief,
    Instructions,
    Kitchen,
    Questions,
    Quiz,
    Rounds,
    Stage,
    Tutorial,
)
from galley.study.written.study_file import StudyFile

TEXT_S: Final = {"consent": 60, "instructions": 90, "debrief": 20, "break": 60}
ITEM_S: Final = 6
ROUND_EXTRA_S: Final = 8
"""Guesses of how long people take to read a page, answer an item, and start and leave a round."""


def estimated_minutes(config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> int:
    """Whole minutes that a visit takes: as written in the file, else a guess from stages and items."""
    if config.minutes is not None:
        return config.minutes
    seconds = sum(stage_s(config, stage, questionnaires) for stage in config.stages)
    return max(1, math.ceil(seconds / 60))


def stage_s(config: StudyFile, stage: Stage, questionnaires: Mapping[str, Questionnaire]) -> float:
    """A guess of how many seconds a stage takes those who meet all of it."""
    seconds = 0.0
    match stage:
        case Consent() | Instructions() | Debrief() | Break():
            seconds = TEXT_S[stage.kind]
        case Questions() | Comparison() | Quiz():
            seconds = _answer_s(config, questionnaires, stage.questionnaire)
        case Tutorial():
            seconds = round_s(config, stage, None) + ROUND_EXTRA_S
        case Rounds():
            after = _answer_s(config, questionnaires, stage.after_each) if stage.after_each else 0.0
            each = stage.count / len(stage.layouts)
            seconds = sum(
                each * (round_s(config, stage, kitchen) + ROUND_EXTRA_S + after) for kitchen in stage.layouts
            )
        case _:
            pass
    limit: int | None = getattr(stage, "time_limit_s", None)
    return seconds if limit is None else min(seconds, limit)


def round_s(config: StudyFile, stage: Tutorial | Rounds, kitchen: Kitchen | None) -> float:
    """The length of a round in seconds, its countdown included."""
    ticks = (kitchen and kitchen.horizon_ticks) or stage.horizon_ticks or config.horizon_ticks
    tick_ms = (kitchen and kitchen.tick_ms) or stage.tick_ms or config.tick_ms
    return config.countdown_s + stage.episodes * ticks * tick_ms / 1000


def text_values(config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> dict[str, int]:
    """What stands for `{minutes}`, `{rounds}` and `{round_s}` in texts."""
    rounds = [stage for stage in config.stages if isinstance(stage, Rounds)]
    lengths = [
        round_s(config, stage, kitchen) - config.countdown_s for stage in rounds for kitchen in stage.layouts
    ]
    usual = max(set(lengths), key=lengths.count) if lengths else config.horizon_ticks * config.tick_ms / 1000
    return {
        "minutes": estimated_minutes(config, questionnaires),
        "rounds": sum(stage.count for stage in rounds),
        "round_s": round(usual),
    }


def _answer_s(config: StudyFile, questionnaires: Mapping[str, Questionnaire], name: str) -> float:
    known = [questionnaires[n] for n in levels_of(name, config.factors) if n in questionnaires]
    return ITEM_S * max((len(questionnaire.items) for questionnaire in known), default=0)
