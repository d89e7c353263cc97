"""How long a visit takes, guessed from its stages, and the numbers that texts may quote."""

from __future__ import annotations

import math
from collections.abc import Mapping

from galley.study.stages.rounds import Rounds, round_s
from galley.study.written.questionnaire import Questionnaire
from galley.study.written.study_file import StudyFile


def estimated_minutes(config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> int:
    """Whole minutes that a visit takes: as written in the file, else a guess from stages and items."""
    if config.minutes is not None:
        return config.minutes
    seconds = sum(stage.seconds(config, questionnaires) for stage in config.stages)
    return max(1, math.ceil(seconds / 60))


def text_values(config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> dict[str, int]:
    """What stands for `{minutes}`, `{rounds}` and `{round_s}` in texts."""
    rounds = [stage for stage in config.stages if isinstance(stage, Rounds)]
    lengths = [
        round_s(config, stage, kitchen) - config.countdown_s for stage in rounds for kitchen in stage.layouts
    ]
    usual = max(set(lengths), key=lengths.count) if lengths else config.horizon_ticks * config.tick_ms / 1000
    return {
        "minutes": estimated_minutes(config, questionnaires),
        "rounds": sum(stage.rounds for stage in rounds),
        "round_s": round(usual),
    }
