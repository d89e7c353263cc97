"""What answers amount to: means of subscales, wrong answers to mark."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from galley.study.written.item_base import Answer
from galley.study.written.items import Item
from galley.study.written.questionnaire import Questionnaire, failed_checks


def subscale_scores(items: Iterable[Item], answers: Mapping[str, Answer]) -> dict[str, float | None]:
    """The mean of each `subscale`'s items, `reversed` ones turned round; None unless all are answered."""
    values: dict[str, list[float | None]] = {}
    for item in items:
        if item.part:
            values.setdefault(item.part, []).append(item.scored(answers.get(item.id)))
    return {subscale: _mean(found) for subscale, found in values.items()}


def wrong_items(questionnaire: Questionnaire, answers: Mapping[str, Answer]) -> dict[str, str]:
    """The items of a quiz that were answered wrongly, each with its hint (perhaps empty)."""
    wrong = failed_checks(questionnaire, answers)
    return {item.id: item.hint for item in questionnaire.items if item.id in wrong}


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None
