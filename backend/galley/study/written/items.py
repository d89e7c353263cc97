"""The kinds of questions that a questionnaire may ask, as its file describes them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from galley.files.reading import FileModel, Loc, faults
from galley.study.written.languages import Text, Words

RESERVED_IDS = ("step",)
"""Names of form fields that the pages need themselves."""

ItemId = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]


class When(FileModel):
    """The item is asked only if the earlier choice `item` was answered with one of `any_of`."""

    item: str
    """The id of a single or multiple choice item above this one."""
    any_of: tuple[str, ...] = Field(min_length=1)
    """Values of its options; one of them has to be chosen."""


class Option(FileModel):
    """One answer to choose: the value that is stored and the words that are shown."""

    value: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=40)]
    """What is stored: lower-case letters, digits, - and _."""
    label: Text
    """What is shown."""


class _Item(FileModel):
    id: ItemId
    """Names the answer in the exports: lower-case letters, digits and _."""
    text: Text
    """The question or statement."""
    help: Words = ""
    """A line below it, in smaller type."""
    required: bool = True
    """Whether it has to be answered."""
    when: When | None = None
    """Asks it only after a certain answer to an earlier choice item."""
    hint: Words = ""
    """Shown beside it when a quiz is answered wrongly."""
    subscale: Annotated[str, Field(pattern=r"^[a-z0-9_-]*$", max_length=40)] = ""
    """The name under which answers to several items are averaged."""


class _Scale(_Item):
    scale: int = Field(7, ge=2, le=101)
    """How many points the scale has."""
    low_label: Text
    """The words at the low end, point 1."""
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


class _Rating(_Scale):
    reversed: bool = False
    """Whether a high point counts as low in its subscale."""
    expected: int | None = None
    """The right point: makes the item an attention check, or a question of a quiz."""

    @model_validator(mode="after")
    def _expected_is_on_the_scale(self) -> Self:
        if self.expected is not None and not 1 <= self.expected <= self.scale:
            raise faults([(("expected",), f"{self.expected} is not on the scale", f"use 1 to {self.scale}")])
        return self


class Likert(_Rating):
    """Agreement with a statement, from 1 (low_label) to `scale` (high_label); `expected` makes it a check."""

    kind: Literal["likert"]
    style: Literal["radio", "stars"] = "radio"
    """Round buttons or stars."""


class SemanticDifferential(_Rating):
    """A place between two opposite words, from 1 (low_label) to `scale` (high_label)."""

    kind: Literal["semantic_differential"]


class Comparison(_Scale):
    """Preference between two partners, from 1 (strongly the first) to `scale` (strongly the second)."""

    kind: Literal["comparison"]


class _Choice(_Item):
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

    def _must_be_options(self, expected: tuple[str, ...]) -> None:
        values = [option.value for option in self.options]
        wrong = [value for value in expected if value not in values]
        if wrong:
            fix = f"use one of {' '.join(values)}"
            raise faults([(("expected",), f"'{value}' is no option", fix) for value in wrong])


class SingleChoice(_Choice):
    """Exactly one of several options; `expected` makes it an attention check."""

    kind: Literal["single_choice"]
    expected: str | None = None
    """The value of the right option: makes the item an attention check, or a question of a quiz."""

    @model_validator(mode="after")
    def _expected_is_an_option(self) -> Self:
        self._must_be_options(() if self.expected is None else (self.expected,))
        return self


class MultipleChoice(_Choice):
    """Any number of several options, at least one if required; `expected` are exactly those to choose."""

    kind: Literal["multiple_choice"]
    expected: tuple[str, ...] | None = Field(None, min_length=1)
    """The values of exactly the right options: makes it a check, or a question of a quiz."""

    @model_validator(mode="after")
    def _expected_are_options(self) -> Self:
        self._must_be_options(self.expected or ())
        return self


class Ranking(_Choice):
    """All options in an order, the best first; every one gets a place."""

    kind: Literal["ranking"]
    options: tuple[Option, ...] = Field(min_length=2, max_length=20)
    """What is put in order."""


class _Amount(_Item):
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
            told = f"'min' {self.min:g} is above 'max' {self.max:g}"
            raise faults([(("min",), told, "exchange them")])
        if self.expected is not None and not self.min <= self.expected <= self.max:
            told = f"{self.expected:g} is out of range"
            raise faults([(("expected",), told, f"use {self.min:g} to {self.max:g}")])
        return self


class Number(_Amount):
    """A number between `min` and `max`, both allowed; a whole one unless `whole: false`."""

    kind: Literal["number"]
    whole: bool = True
    """Whether only whole numbers are answers."""


class Slider(_Amount):
    """A place on a line from `min` to `max` in steps of `step`; no answer until it is touched."""

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
            told = f"steps of {self.step:g} do not lead from {self.min:g} to {self.max:g}"
            raise faults([(("step",), told, "choose a step that divides the line")])
        return self


class ShortText(_Item):
    """One line of text."""

    kind: Literal["short_text"]
    max_length: int = Field(200, ge=1, le=1000)
    """The most characters."""


class LongText(_Item):
    """Several lines of text."""

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


def item_faults(items: tuple[Any, ...]) -> list[tuple[Loc, str, str]]:
    """What is wrong between the items of one file: ids that stand twice, conditions on what was not asked."""
    found: list[tuple[Loc, str, str]] = []
    choices: dict[str, list[str]] = {}
    seen: set[str] = set()
    for place, item in enumerate(items):
        if item.id in seen:
            found.append(((place, "id"), f"item id '{item.id}' stands twice", "give each item its own id"))
        if item.id in RESERVED_IDS:
            found.append(((place, "id"), f"item id '{item.id}' is taken by the page", "choose another id"))
        if item.when is not None:
            values = choices.get(item.when.item)
            if values is None:
                told = f"'when' asks for '{item.when.item}', which is no choice item above this one"
                known = " ".join(choices) or "single_choice items that stand above"
                found.append(((place, "when", "item"), told, f"use one of {known}"))
            else:
                found += [
                    (
                        (place, "when", "any_of", n),
                        f"'{value}' is no option of '{item.when.item}'",
                        f"use one of {' '.join(values)}",
                    )
                    for n, value in enumerate(item.when.any_of)
                    if value not in values
                ]
        if isinstance(item, (SingleChoice, MultipleChoice)):
            choices[item.id] = [option.value for option in item.options]
        if getattr(item, "expected", None) is not None and not item.required:
            told = f"item '{item.id}' has an expected answer but need not be answered"
            found.append(((place, "required"), told, "remove `required: false`, or the expected answer"))
        seen.add(item.id)
    return found
