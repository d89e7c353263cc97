"""Questionnaires, and the answers that fit them."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import Field, field_validator

from galley.files.reading import FileModel, Loaded, faults, load
from galley.study.written.items import (
    Comparison,
    Item,
    Likert,
    LongText,
    MultipleChoice,
    Number,
    Ranking,
    SemanticDifferential,
    ShortText,
    SingleChoice,
    Slider,
    item_faults,
)
from galley.study.written.languages import Text, Words

Answer = int | float | str | list[str] | None
Say = Callable[[str], str]
"""Translates a message before its `{places}` are filled in, as gettext does."""

_WHOLE = re.compile(r"[+-]?\d{1,15}")
_DECIMAL = re.compile(r"[+-]?\d{1,15}([.,]\d{1,15})?")


class Questionnaire(FileModel):
    """A questionnaire file: its title and items in order, and where they come from."""

    format: Literal[1]
    """Version of this kind of file."""
    title: Text
    """The heading of its page."""
    source: Text
    """Where its items come from."""
    intro: Words = ""
    """Words above the items."""
    order: Literal["fixed", "random"] = "fixed"
    """Items as written, or shuffled for each visit; an item with `when` stays behind the one it asks for."""
    items: tuple[Item, ...] = Field(min_length=1, max_length=300)
    """The items, see below."""

    @field_validator("items")
    @classmethod
    def _items_fit_together(cls, items: tuple[Item, ...]) -> tuple[Item, ...]:
        found = item_faults(items)
        if found:
            raise faults(found)
        return items

    @property
    def expected(self) -> dict[str, Any]:
        """The right answer of every item that has one."""
        right = {item.id: getattr(item, "expected", None) for item in self.items}
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in right.items()
            if value is not None
        }

    def arranged(self, item_order: Sequence[str]) -> Questionnaire:
        """The same questionnaire with its items in this order of their ids."""
        by_id = {item.id: item for item in self.items}
        return self.model_copy(update={"items": tuple(by_id[name] for name in item_order)})


def load_questionnaire(
    path: Path, shown: str | None = None, context: Mapping[str, Any] | None = None
) -> Loaded[Questionnaire]:
    """The questionnaire in a file; `context` may hold the `language` to read and all `languages` wanted.

    Raises:
        InvalidFiles: everything that is wrong with it.
    """
    return load(path, Questionnaire, shown, context)


def validate_answers(
    questionnaire: Questionnaire, form: Mapping[str, Sequence[str]], say: Say = str
) -> tuple[dict[str, Answer], dict[str, str]]:
    """(answers, problems) of a submitted form; the answers count only if there are no problems.

    `form` maps a field name to its values as sent; names that are no item are ignored. Answers have every
    item: a scale's point as int (1 is the low end), a choice as the option's value, several as a list in the
    order of the file, a ranking as a list with the first place first, a number or slider as int or float,
    text without blanks around it, None for what was left blank or not asked. Problems map an item's id to
    what a participant should do, translated by `say`. Nothing is filled in: an untouched scale is a problem,
    never a value.
    """
    answers: dict[str, Answer] = {}
    problems: dict[str, str] = {}
    for item in questionnaire.items:
        answers[item.id] = None
        if not asked(item, answers):
            continue
        given = _given(item, form)
        if not any(given):
            if item.required:
                problems[item.id] = _missing(item, say)
            continue
        if len(given) > 1 and not isinstance(item, (MultipleChoice, Ranking)):
            problems[item.id] = say("Please give one answer only.")
            continue
        try:
            answers[item.id] = _answer(item, given, say)
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
    """The ids of the attention checks (items with `expected`) that were asked and answered otherwise."""
    right = questionnaire.expected
    return tuple(
        item.id
        for item in questionnaire.items
        if item.id in right and asked(item, answers) and not is_right(right[item.id], answers.get(item.id))
    )


def is_right(expected: object, answer: object) -> bool:
    """Whether an answer is the expected one; of several choices exactly those, in any order."""
    if isinstance(expected, list):
        return isinstance(answer, list) and sorted(answer) == sorted(expected)
    return answer == expected


def rank_field(item_id: str, value: str) -> str:
    """The form field that holds the place of one option of a ranking, 1 for the first."""
    return f"{item_id}.{value}"


def _given(item: Item, form: Mapping[str, Sequence[str]]) -> list[str]:
    """The cleaned values of an item's fields, blank ones left out; a ranking has one for each option."""
    if isinstance(item, Ranking):
        fields = [form.get(rank_field(item.id, option.value), ()) for option in item.options]
        return [_clean(values[0]) if len(values) == 1 else "" for values in fields]
    return [value for value in map(_clean, form.get(item.id, ())) if value]


def _missing(item: Item, say: Say) -> str:
    match item:
        case Likert() | Comparison() | SemanticDifferential():
            return say("Please choose a point on the scale.")
        case SingleChoice():
            return say("Please choose one answer.")
        case MultipleChoice():
            return say("Please choose at least one answer.")
        case Ranking():
            return say("Please give every answer a place.")
        case Number():
            return say("Please enter a number.")
        case Slider():
            return say("Please choose a point on the line.")
        case _:
            return say("Please answer this question.")


def _answer(item: Item, given: list[str], say: Say) -> Answer:
    match item:
        case Likert() | Comparison() | SemanticDifferential():
            if given[0] not in map(str, range(1, item.scale + 1)):
                raise ValueError(say("Please choose a point from 1 to {most}.").format(most=item.scale))
            return int(given[0])
        case SingleChoice() | MultipleChoice():
            values = [option.value for option in item.options]
            if any(value not in values for value in given):
                raise ValueError(say("Please choose from the answers shown."))
            return given[0] if isinstance(item, SingleChoice) else [v for v in values if v in given]
        case Ranking():
            return _ranked(item, given, say)
        case Number():
            return _number(item, given[0], say)
        case Slider():
            return _point(item, given[0], say)
        case ShortText() | LongText():
            text = given[0] if isinstance(item, LongText) else " ".join(given[0].splitlines())
            if len(text) > item.max_length:
                told = say("Please shorten this to {most} characters; it has {now} now.")
                raise ValueError(told.format(most=item.max_length, now=len(text)))
            return text


def _ranked(item: Ranking, given: list[str], say: Say) -> list[str]:
    places = [str(place) for place in range(1, len(item.options) + 1)]
    if "" in given:
        raise ValueError(say("Please give every answer a place."))
    if sorted(given) != sorted(places):
        raise ValueError(say("Please give each place from 1 to {most} once.").format(most=len(places)))
    ranked = dict(zip(given, item.options, strict=True))
    return [ranked[place].value for place in places]


def _number(item: Number, text: str, say: Say) -> int | float:
    if not (_WHOLE if item.whole else _DECIMAL).fullmatch(text):
        raise ValueError(say("Please enter a whole number.") if item.whole else say("Please enter a number."))
    value = int(text) if item.whole else float(text.replace(",", "."))
    if not item.min <= value <= item.max or not math.isfinite(value):
        told = say("Please enter a number from {least} to {most}.")
        raise ValueError(told.format(least=f"{item.min:g}", most=f"{item.max:g}"))
    return value


def _point(item: Slider, text: str, say: Say) -> int | float:
    told = say("Please choose a point from {least} to {most}.")
    told = told.format(least=f"{item.min:g}", most=f"{item.max:g}")
    if not _DECIMAL.fullmatch(text):
        raise ValueError(told)
    value = float(text.replace(",", "."))
    steps = (value - item.min) / item.step
    if not item.min <= value <= item.max or abs(steps - round(steps)) > STEP_TOLERANCE:
        raise ValueError(told)
    return int(value) if value.is_integer() else value


STEP_TOLERANCE: Final = 1e-6
"""How far, in steps, a slider's value may lie beside a step: what decimal fractions lose."""


def _clean(text: str) -> str:
    """Text as it may be stored: lines end in one newline, no control characters, no blanks around it."""
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return "".join(c for c in text if c == "\n" or unicodedata.category(c) not in ("Cc", "Cs")).strip()
