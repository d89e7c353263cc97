"""What answers amount to: signed preferences, sums of scales, wrong answers to mark."""

from __future__ import annotations

from collections.abc import Mapping

from galley.study.written.items import Comparison, Likert, SemanticDifferential, Slider
from galley.study.written.questionnaire import Answer, Questionnaire, failed_checks


def signed_preference(item: Comparison, answer: Answer) -> float | None:
    """How strongly the second partner (above 0) or the first (below 0) is preferred; 0 is no preference.

    In points from the middle of the scale: -3 to 3 for a scale of 7. None for what was not answered.
    """
    return answer - (item.scale + 1) / 2 if isinstance(answer, (int, float)) else None


def subscale_scores(questionnaire: Questionnaire, answers: Mapping[str, Answer]) -> dict[str, float | None]:
    """The mean of each `subscale`'s items, `reversed` ones turned round; None unless all are answered."""
    values: dict[str, list[float | None]] = {}
    for item in questionnaire.items:
        if item.subscale and isinstance(item, (Likert, SemanticDifferential, Slider)):
            low, high = (item.min, item.max) if isinstance(item, Slider) else (1, item.scale)
            answer = answers.get(item.id)
            value = float(answer) if isinstance(answer, (int, float)) else None
            turned = value if value is None or not item.reversed else low + high - value
            values.setdefault(item.subscale, []).append(turned)
    return {subscale: _mean(found) for subscale, found in values.items()}


def wrong_items(questionnaire: Questionnaire, answers: Mapping[str, Answer]) -> dict[str, str]:
    """The items of a quiz that were answered wrongly, each with its hint (perhaps empty)."""
    wrong = failed_checks(questionnaire, answers)
    return {item.id: item.hint for item in questionnaire.items if item.id in wrong}


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None
