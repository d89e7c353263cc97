"""How many minutes and rounds visits meet, guessed from their stages: the numbers that texts may quote."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from galley.study.stages.rounds import Rounds, round_s
from galley.study.written.factors import Factor
from galley.study.written.questionnaire import Questionnaire
from galley.study.written.study_file import StudyFile

Ranges = Mapping[str, tuple[int, int]]
"""The least and the most of each number that a text may quote."""


def estimated_minutes(config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> int:
    """Whole minutes that all stages take: as written in the file, else a guess from stages and items."""
    if config.minutes is not None:
        return config.minutes
    seconds = sum(stage.seconds(config, questionnaires) for stage in config.stages)
    return max(1, math.ceil(seconds / 60))


def ranges(
    config: StudyFile, questionnaires: Mapping[str, Questionnaire], conditions: Iterable[Mapping[str, str]]
) -> Ranges:
    """What visits of these conditions meet: `minutes`, `rounds` that count and `round_s`, seconds of one.

    A stage that answers decide counts for the most and not for the least.
    """
    met = [_met(config, condition, least=least) for condition in conditions for least in (False, True)]
    lengths = [length for part in met for length in _lengths(part)]
    found = {
        "minutes": [estimated_minutes(part, questionnaires) for part in met],
        "rounds": [sum(stage.rounds for stage in part.stages) for part in met],
        "round_s": [round(length) for length in lengths or [config.horizon_ticks * config.tick_ms / 1000]],
    }
    return {name: (min(values), max(values)) for name, values in found.items()}


def in_figures(least: int, most: int) -> str:
    """A number in any language: one, or the least and the most with a dash between them."""
    return str(most) if least == most else f"{least}\u2013{most}"


def _met(config: StudyFile, condition: Mapping[str, str], *, least: bool) -> StudyFile:
    """What visits of a condition meet of the file; `least` leaves out what depends on answers."""
    stages = tuple(
        stage
        for stage in config.stages
        if stage.meets(condition) and not (least and any(one.factor is None for one in stage.conditions))
    )
    factors = {name: Factor.model_construct(levels=(level,)) for name, level in condition.items()}
    return config.model_copy(update={"stages": stages, "factors": factors})


def _lengths(config: StudyFile) -> Iterator[float]:
    """Seconds of each kind of round that counts, its countdown left out."""
    for stage in config.stages:
        if isinstance(stage, Rounds):
            yield from (round_s(config, stage, kitchen) - config.countdown_s for kitchen in stage.layouts)
