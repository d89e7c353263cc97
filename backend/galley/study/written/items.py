"""The kinds of questions that a questionnaire may ask: what their files say, and what their answers mean.

A kind is one class here and one macro of `_items.html`. Its docstring and `stored` are its entry in
docs/study-files.md; `simulate` fills in whatever fields it draws.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from galley.files.reading import Loc, faults
from galley.study.written.item_base import Answer, BaseItem, Option, Say, cleaned, plain, turned_round
from galley.study.written.languages import Text, Words
from galley.translations import mark

_WHOLE: Final = re.compile(r"[+-]?\d{1,15}")
_DECIMAL: Final = re.compile(r"[+-]?\d{1,15}([.,]\d{1,15})?")
_AMBIGUOUS: Final = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
"""One separator with three digits behind it: 1,500 is 1500 to some and 1.5 to others, as 1.500 is."""
STEP_TOLERANCE: Final = 1e-6
"""How far, in steps, a slider's value may lie beside a step: what decimal fractions lose."""


class _Scale(BaseItem):
    drawn_as = "scale"
    stored = "the number of the point: 1 to `scale`, or as many from `start` on"
    radio_group = True
    numeric = True
    missing = mark("Please choose a point on the scale.")

    scale: int = Field(7, ge=2, le=101)
    """How many points the scale has."""
    start: int = Field(1, ge=-100, le=100)
    """The number of the point at the low end: 0 with a `scale` of 11 is 0 to 10, -3 with 7 is -3 to +3."""
    low_label: Text
    """The words at the low end."""
    high_label: Text
    """The words at the high end."""
    labels: tuple[Words, ...] = ()
    """Words for every point, or none."""

    @model_validator(mode="after")
    def _one_label_per_point(self) -> Self:
        if self.labels and len(self.labels) != self.scale:
            told = f"{len(self.labels)} labels for a scale of {self.scale}"
            raise faults([(("labels",), told, f"write {self.scale} labels, or none")])
        return self

    @property
    def points(self) -> range:
        """The numbers of its points, the low end first."""
        return range(self.start, self.start + self.scale)

    def answer(self, given: Sequence[str], say: Say) -> int:
        """The number of the point."""
        if given[0] not in map(str, self.points):
            told = say("Please choose a point from {least} to {most}.")
            raise ValueError(told.format(least=self.points[0], most=self.points[-1]))
        return int(given[0])

    def label_of(self, answer: Answer) -> str | None:
        """The words at a point, where every point has words."""
        return self.labels[self.points.index(answer)] if self.labels and isinstance(answer, int) else None


class _Rating(_Scale):
    scores = True

    reversed: bool = False
    """Whether a high point counts as low in its subscale."""
    expected: int | None = None
    """The right point: makes the item an attention check, or a question of a quiz."""

    @model_validator(mode="after")
    def _expected_is_on_the_scale(self) -> Self:
        if self.expected is not None and self.expected not in self.points:
            fix = f"use {self.points[0]} to {self.points[-1]}"
            raise faults([(("expected",), f"{self.expected} is not on the scale", fix)])
        return self

    def scored(self, answer: Answer) -> float | None:
        """The point, counted from the other end if the item is reversed."""
        return turned_round(answer, self.points[0], self.points[-1], reversed_=self.reversed)


class Likert(_Rating):
    """Agreement with a statement, from `low_label` to `high_label`; `expected` makes it a check."""

    kind: Literal["likert"]
    style: Literal["radio", "stars"] = "radio"
    """Round buttons or stars."""


class SemanticDifferential(_Rating):
    """A place between two opposite words, such as *dull* and *clever*."""

    kind: Literal["semantic_differential"]


class Comparison(_Scale):
    """Preference between two partners, from strongly the first (the low end) to strongly the second.

    The item kind is `comparison`, for comparison stages only.
    """

    compares = True
    stored = (
        "the number of the point, the lowest strongly the first partner, and the signed preference, "
        "from below 0 for the first to above 0 for the second"
    )

    kind: Literal["comparison"]

    def preference(self, answer: Answer) -> float | None:
        """Points from the middle of the scale: -3 to 3 for a scale of 7; 0 is no preference."""
        return answer - sum(self.points) / self.scale if isinstance(answer, (int, float)) else None


class _Choice(BaseItem):
    drawn_as = "choices"

    options: tuple[Option, ...] = Field(min_length=2, max_length=50)
    """The answers to choose from."""

    @model_validator(mode="after")
    def _values_differ(self) -> Self:
        values = [option.value for option in self.options]
        twice: list[tuple[Loc, str, str]] = [
            (("options", place, "value"), f"option '{value}' stands twice", "give each option its own value")
            for place, value in enumerate(values)
            if value in values[:place]
        ]
        if twice:
            raise faults(twice)
        return self

    @property
    def values(self) -> tuple[str, ...]:
        """What may be stored of each option, in the order of the file."""
        return tuple(option.value for option in self.options)

    def longest_fields(self) -> list[tuple[str, int]]:
        """One for each option."""
        return [(self.id, len(value)) for value in self.values]

    def label_of(self, answer: Answer) -> str | None:
        """The words of the chosen options."""
        if answer is None:
            return None
        words = {option.value: option.label for option in self.options}
        chosen = answer if isinstance(answer, list) else [answer]
        return " | ".join(words.get(str(one), str(one)) for one in chosen)

    def _must_be_options(self, expected: tuple[str, ...]) -> None:
        wrong = [value for value in expected if value not in self.values]
        if wrong:
            fix = f"use one of {' '.join(self.values)}"
            raise faults([(("expected",), f"'{value}' is no option", fix) for value in wrong])

    def _only_options(self, given: Sequence[str], say: Say) -> None:
        if any(value not in self.values for value in given):
            raise ValueError(say("Please choose from the answers shown."))


class SingleChoice(_Choice):
    """Exactly one of several options; `expected` makes it an attention check."""

    stored = "the value of the option"
    radio_group = True
    missing = mark("Please choose one answer.")

    kind: Literal["single_choice"]
    expected: str | None = None
    """The value of the right option: makes the item an attention check, or a question of a quiz."""

    @model_validator(mode="after")
    def _expected_is_an_option(self) -> Self:
        self._must_be_options(() if self.expected is None else (self.expected,))
        return self

    @property
    def choosable(self) -> tuple[str, ...]:
        """The options."""
        return self.values

    def answer(self, given: Sequence[str], say: Say) -> str:
        """The option's value."""
        self._only_options(given, say)
        return given[0]


class MultipleChoice(_Choice):
    """Any number of several options, at least one if required; `expected` are exactly those to choose."""

    stored = "a list of values"
    many_values = True
    missing = mark("Please choose at least one answer.")

    kind: Literal["multiple_choice"]
    expected: tuple[str, ...] | None = Field(None, min_length=1)
    """The values of exactly the right options: makes it a check, or a question of a quiz."""

    @model_validator(mode="after")
    def _expected_are_options(self) -> Self:
        self._must_be_options(self.expected or ())
        return self

    @property
    def choosable(self) -> tuple[str, ...]:
        """The options."""
        return self.values

    def answer(self, given: Sequence[str], say: Say) -> list[str]:
        """The options' values in the order of the file."""
        self._only_options(given, say)
        return [value for value in self.values if value in given]


class Ranking(_Choice):
    """All options in an order, the best first; every one gets a place."""

    drawn_as = "ranking"
    stored = "the values of all options, first place first"
    many_values = True
    missing = mark("Please give every answer a place.")

    kind: Literal["ranking"]
    options: tuple[Option, ...] = Field(min_length=2, max_length=20)
    """What is put in order."""

    def field(self, value: str) -> str:
        """The form field that holds the place of one option, 1 for the first."""
        return f"{self.id}.{value}"

    def longest_fields(self) -> list[tuple[str, int]]:
        """The place of every option."""
        return [(self.field(value), 2) for value in self.values]

    def given(self, form: Mapping[str, Sequence[str]]) -> list[str]:
        """The place of every option, blank where there is none or more than one."""
        fields = [form.get(self.field(value), ()) for value in self.values]
        return [cleaned(places[0]) if len(places) == 1 else "" for places in fields]

    def answer(self, given: Sequence[str], say: Say) -> list[str]:
        """The options' values, the first place first."""
        places = [str(place) for place in range(1, len(self.options) + 1)]
        if "" in given:
            raise ValueError(say(self.missing))
        if sorted(given) != sorted(places):
            raise ValueError(say("Please give each place from 1 to {most} once.").format(most=len(places)))
        ranked = dict(zip(given, self.values, strict=True))
        return [ranked[place] for place in places]

    def as_sent(self, answer: Answer) -> dict[str, list[str]]:
        """A field for each option with its place."""
        ranked = answer if isinstance(answer, list) else []
        return {self.field(value): [str(place)] for place, value in enumerate(ranked, 1)}


class _Amount(BaseItem):
    stored = "the number"
    numeric = True

    min: float
    """The smallest answer."""
    max: float
    """The largest answer."""
    unit: Words = ""
    """Shown behind the answer."""
    expected: float | None = None
    """The right answer: makes the item an attention check, or a question of a quiz."""

    @model_validator(mode="after")
    def _range_is_not_empty(self) -> Self:
        if self.min > self.max:
            told = f"'min' {self.least} is above 'max' {self.most}"
            raise faults([(("min",), told, "exchange them")])
        if self.expected is not None and not self.min <= self.expected <= self.max:
            told = f"{plain(self.expected)} is out of range"
            raise faults([(("expected",), told, f"use {self.least} to {self.most}")])
        return self

    @property
    def least(self) -> str:
        """`min` as it is shown."""
        return plain(self.min)

    @property
    def most(self) -> str:
        """`max` as it is shown."""
        return plain(self.max)


class Number(_Amount):
    """A number between `min` and `max`, both allowed; a whole one unless `whole: false`."""

    drawn_as = "number"
    missing = mark("Please enter a number.")

    kind: Literal["number"]
    whole: bool = True
    """Whether only whole numbers are answers."""

    def answer(self, given: Sequence[str], say: Say) -> int | float:
        """The number; a comma may stand for the decimal point, unless it may as well part thousands."""
        text = given[0]
        if not (_WHOLE if self.whole else _DECIMAL).fullmatch(text):
            raise ValueError(say("Please enter a whole number.") if self.whole else say(self.missing))
        if not self.whole and _AMBIGUOUS.fullmatch(text):
            whole, fraction = re.split("[.,]", text)
            digits = fraction.rstrip("0") or "0"
            decimal = f"{whole}.{digits + '0' if len(digits) == 3 else digits}"
            told = say("{text} can be read in two ways. Please write {thousands} or {decimal}.")
            raise ValueError(told.format(text=text, thousands=whole + fraction, decimal=decimal))
        value = int(text) if self.whole else float(text.replace(",", "."))
        if not self.min <= value <= self.max or not math.isfinite(value):
            told = say("Please enter a number from {least} to {most}.")
            raise ValueError(told.format(least=self.least, most=self.most))
        return value


class Slider(_Amount):
    """A place on a line from `min` to `max` in steps of `step`.

    A slider has no answer until it is touched: an untouched one is refused, never stored as a value.
    """

    drawn_as = "slider"
    scores = True
    missing = mark("Please choose a point on the line.")

    kind: Literal["slider"]
    min: float = 0
    """The answer at the low end."""
    max: float = 100
    """The answer at the high end."""
    step: float = Field(1, gt=0)
    """How far apart the answers lie; NASA-TLX has 0 to 100 in steps of 5."""
    low_label: Text
    """The words at the low end."""
    high_label: Text
    """The words at the high end."""
    show_value: bool = False
    """Whether the number is shown."""
    reversed: bool = False
    """Whether a high answer counts as low in its subscale."""

    @model_validator(mode="after")
    def _steps_fill_the_line(self) -> Self:
        steps = (self.max - self.min) / self.step
        if steps < 1 or abs(steps - round(steps)) > 1e-9:
            told = f"steps of {self.pace} do not lead from {self.least} to {self.most}"
            raise faults([(("step",), told, "choose a step that divides the line")])
        return self

    @property
    def pace(self) -> str:
        """`step` as it is shown."""
        return plain(self.step)

    def answer(self, given: Sequence[str], say: Say) -> int | float:
        """The number at the point."""
        told = say("Please choose a point from {least} to {most}.").format(least=self.least, most=self.most)
        if not _DECIMAL.fullmatch(given[0]):
            raise ValueError(told)
        value = float(given[0].replace(",", "."))
        steps = (value - self.min) / self.step
        if not self.min <= value <= self.max or abs(steps - round(steps)) > STEP_TOLERANCE:
            raise ValueError(told)
        return int(value) if value.is_integer() else value

    def scored(self, answer: Answer) -> float | None:
        """The number, counted from the other end if the item is reversed."""
        return turned_round(answer, self.min, self.max, reversed_=self.reversed)


class _Words(BaseItem):
    stored = "the text"
    max_length: int

    def longest_fields(self) -> list[tuple[str, int]]:
        """The text; a line break is sent as two characters."""
        return [(self.id, self.max_length)]

    def answer(self, given: Sequence[str], say: Say) -> str:
        """The text."""
        text = self._laid_out(given[0])
        if len(text) > self.max_length:
            told = say("Please shorten this to {most} characters; it has {now} now.")
            raise ValueError(told.format(most=self.max_length, now=len(text)))
        return text

    def _laid_out(self, text: str) -> str:
        return text


class ShortText(_Words):
    """One line of text."""

    drawn_as = "line"

    kind: Literal["short_text"]
    max_length: int = Field(200, ge=1, le=1000)
    """The most characters."""

    def _laid_out(self, text: str) -> str:
        return " ".join(text.splitlines())


class LongText(_Words):
    """Several lines of text."""

    drawn_as = "lines"

    kind: Literal["long_text"]
    max_length: int = Field(5000, ge=1, le=20000)
    """The most characters."""


Item = Annotated[
    Likert
    | SemanticDifferential
    | Comparison
    | SingleChoice
    | MultipleChoice
    | Ranking
    | Number
    | Slider
    | ShortText
    | LongText,
    Field(discriminator="kind"),
]

_ANY_ITEM: Final[TypeAdapter[Item]] = TypeAdapter(Item)


def stored_item(shown: Mapping[str, Any] | None) -> Item | None:
    """The item that was shown, from its stored fields; None if they are unknown or of a kind that is gone."""
    try:
        return None if shown is None else _ANY_ITEM.validate_python(shown)
    except ValidationError:
        return None
