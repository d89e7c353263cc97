"""Questionnaires, and the answers that fit them."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from pydantic import Field, field_validator

from galley.files import FileModel, Loaded, faults, load
from galley.study.items import (
    Comparison,
    Item,
    Likert,
    LongText,
    MultipleChoice,
    Number,
    ShortText,
    SingleChoice,
    Text,
    item_faults,
)

Answer = int | float | str | list[str] | None

_WHOLE = re.compile(r"[+-]?\d{1,15}")
_DECIMAL = re.compile(r"[+-]?\d{1,15}([.,]\d{1,15})?")


class Questionnaire(FileModel):
    """A questionnaire file: its title and items in order, and where they come from."""

    format: Literal[1]
    title: Text
    source: Text
    intro: str = ""
    items: tuple[Item, ...] = Field(min_length=1)

    @field_validator("items")
    @classmethod
    def _items_fit_together(cls, items: tuple[Item, ...]) -> tuple[Item, ...]:
        found = item_faults(items)
        if found:
            raise faults(found)
        return items


def load_questionnaire(path: Path, shown: str | None = None) -> Loaded[Questionnaire]:
    """The questionnaire in a file.

    Raises:
        InvalidFiles: everything that is wrong with it.
    """
    return load(path, Questionnaire, shown)


def validate_answers(
    questionnaire: Questionnaire, form: Mapping[str, Sequence[str]]
) -> tuple[dict[str, Answer], dict[str, str]]:
    """(answers, problems) of a submitted form; the answers count only if there are no problems.

    `form` maps a field name to its values as sent; names that are no item are ignored. Answers have every
    item: a scale's point as int (1 is the low end), a choice as the option's value, several as a list in the
    order of the file, a number as int or float, text without blanks around it, None for what was left blank
    or not asked. Problems map an item's id to what a participant should do. Nothing is filled in: an
    untouched scale is a problem, never a value.
    """
    answers: dict[str, Answer] = {}
    problems: dict[str, str] = {}
    for item in questionnaire.items:
        given = [value for value in map(_clean, form.get(item.id, ())) if value]
        answers[item.id] = None
        if not asked(item, answers):
            continue
        if not given:
            if item.required:
                problems[item.id] = _MISSING.get(item.kind, "Please answer this question.")
            continue
        if len(given) > 1 and not isinstance(item, MultipleChoice):
            problems[item.id] = "Please give one answer only."
            continue
        try:
            answers[item.id] = _answer(item, given)
        except ValueError as error:
            problems[item.id] = str(error)
    return answers, problems


def asked(item: Item, answers: Mapping[str, Answer]) -> bool:
    """Whether the answers given so far make this item one that is asked."""
    if item.when is None:
        return True
    chosen = answers.get(item.when.item)
    values = chosen if isinstance(chosen, list) else [chosen]
    return any(value in item.when.any_of for value in values)


def failed_checks(questionnaire: Questionnaire, answers: Mapping[str, Answer]) -> tuple[str, ...]:
    """The ids of the attention checks (items with `expected`) that were answered otherwise."""
    return tuple(
        item.id
        for item in questionnaire.items
        if isinstance(item, (Likert, SingleChoice))
        and item.expected is not None
        and asked(item, answers)
        and answers.get(item.id) != item.expected
    )


_MISSING = {
    "likert": "Please choose a point on the scale.",
    "comparison": "Please choose a point on the scale.",
    "single_choice": "Please choose one answer.",
    "multiple_choice": "Please choose at least one answer.",
    "number": "Please enter a number.",
}


def _answer(item: Item, given: list[str]) -> Answer:
    match item:
        case Likert() | Comparison():
            if given[0] not in map(str, range(1, item.scale + 1)):
                raise ValueError(f"Please choose a point from 1 to {item.scale}.")
            return int(given[0])
        case SingleChoice() | MultipleChoice():
            values = [option.value for option in item.options]
            if any(value not in values for value in given):
                raise ValueError("Please choose from the answers shown.")
            return given[0] if isinstance(item, SingleChoice) else [v for v in values if v in given]
        case Number():
            return _number(item, given[0])
        case ShortText() | LongText():
            text = given[0] if isinstance(item, LongText) else " ".join(given[0].splitlines())
            if len(text) > item.max_length:
                told = f"Please shorten this to {item.max_length} characters; it has {len(text)} now."
                raise ValueError(told)
            return text


def _number(item: Number, text: str) -> int | float:
    if not (_WHOLE if item.whole else _DECIMAL).fullmatch(text):
        raise ValueError("Please enter a whole number." if item.whole else "Please enter a number.")
    value = int(text) if item.whole else float(text.replace(",", "."))
    if not item.min <= value <= item.max or not math.isfinite(value):
        raise ValueError(f"Please enter a number from {item.min:g} to {item.max:g}.")
    return value


def _clean(text: str) -> str:
    """Text as it may be stored: lines end in one newline, no control characters, no blanks around it."""
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return "".join(c for c in text if c == "\n" or unicodedata.category(c) not in ("Cc", "Cs")).strip()
