"""The kinds of questions that a questionnaire may ask, as its file describes them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from galley.files import FileModel, Loc, faults

RESERVED_IDS = ("step",)
"""Names of form fields that the pages need themselves."""

Text = Annotated[str, Field(min_length=1, max_length=2000)]
ItemId = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]


class When(FileModel):
    """The item is asked only if the earlier choice `item` was answered with one of `any_of`."""

    item: str
    any_of: tuple[str, ...] = Field(min_length=1)


class Option(FileModel):
    """One answer to choose: the value that is stored and the words that are shown."""

    value: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=40)]
    label: Text


class _Item(FileModel):
    id: ItemId
    text: Text
    help: str = ""
    required: bool = True
    when: When | None = None


class _Scale(_Item):
    scale: int = Field(7, ge=2, le=11)
    low_label: Text
    high_label: Text
    labels: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _one_label_per_point(self) -> Self:
        if self.labels and len(self.labels) != self.scale:
            told = f"{len(self.labels)} labels for a scale of {self.scale}"
            raise faults([(("labels",), told, f"write {self.scale} labels, or none")])
        return self


class Likert(_Scale):
    """Agreement with a statement, from 1 (low_label) to `scale` (high_label); `expected` makes it a check."""

    kind: Literal["likert"]
    style: Literal["radio", "stars"] = "radio"
    expected: int | None = None

    @model_validator(mode="after")
    def _expected_is_on_the_scale(self) -> Self:
        if self.expected is not None and not 1 <= self.expected <= self.scale:
            raise faults([(("expected",), f"{self.expected} is not on the scale", f"use 1 to {self.scale}")])
        return self


class Comparison(_Scale):
    """Preference between two partners, from 1 (strongly the first) to `scale` (strongly the second)."""

    kind: Literal["comparison"]


class _Choice(_Item):
    options: tuple[Option, ...] = Field(min_length=2)

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


class SingleChoice(_Choice):
    """Exactly one of several options; `expected` makes it an attention check."""

    kind: Literal["single_choice"]
    expected: str | None = None

    @model_validator(mode="after")
    def _expected_is_an_option(self) -> Self:
        values = [option.value for option in self.options]
        if self.expected is not None and self.expected not in values:
            fix = f"use one of {' '.join(values)}"
            raise faults([(("expected",), f"'{self.expected}' is no option", fix)])
        return self


class MultipleChoice(_Choice):
    """Any number of several options; at least one if the item is required."""

    kind: Literal["multiple_choice"]


class Number(_Item):
    """A number between `min` and `max`, both allowed; a whole one unless `whole: false`."""

    kind: Literal["number"]
    min: float
    max: float
    whole: bool = True
    unit: str = ""

    @model_validator(mode="after")
    def _range_is_not_empty(self) -> Self:
        if self.min > self.max:
            told = f"'min' {self.min:g} is above 'max' {self.max:g}"
            raise faults([(("min",), told, "exchange them")])
        return self


class ShortText(_Item):
    """One line of text."""

    kind: Literal["short_text"]
    max_length: int = Field(200, ge=1, le=1000)


class LongText(_Item):
    """Several lines of text."""

    kind: Literal["long_text"]
    max_length: int = Field(5000, ge=1, le=20000)


Item = Annotated[
    Likert | Comparison | SingleChoice | MultipleChoice | Number | ShortText | LongText,
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
        seen.add(item.id)
    return found
