"""What every item of a questionnaire has, and what it makes of a form: an answer, and what it counts for."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, ClassVar, Final

from pydantic import Field

from galley.files.reading import FileModel
from galley.study.written.languages import Text, Words
from galley.translations import mark

Answer = int | float | str | list[str] | None
Say = Callable[[str], str]
"""Translates a message before its `{places}` are filled in, as gettext does."""

BYTES_PER_CHARACTER: Final = 9
"""What a character takes at most of what browsers send: three bytes of UTF-8, each as %XX."""

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


class BaseItem(FileModel):
    """An item of any kind; a kind says what is its own."""

    drawn_as: ClassVar[str]
    """The macro of `_items.html` that draws its fields."""
    stored: ClassVar[str]
    """What is stored as its answer, in words for the documentation."""
    radio_group: ClassVar[bool] = False
    """Whether its fields are buttons of which one is chosen."""
    many_values: ClassVar[bool] = False
    """Whether a form may hold several values for it."""
    numeric: ClassVar[bool] = False
    """Whether its answer is a number, which conditions may compare."""
    compares: ClassVar[bool] = False
    """Whether it asks about two partners."""
    missing: ClassVar[str] = mark("Please answer this question.")
    """What to do about it, told to those who left it blank."""
    scores: ClassVar[bool] = False
    """Whether its answer counts in its subscale."""

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

    def longest_fields(self) -> list[tuple[str, int]]:
        """(name, most characters) of every field that a form may hold for it."""
        return [(self.id, 40)]

    def given(self, form: Mapping[str, Sequence[str]]) -> list[str]:
        """The cleaned values of its fields in a form; a list without any text if it was left blank."""
        return [value for value in map(cleaned, form.get(self.id, ())) if value]

    def answer(self, given: Sequence[str], say: Say) -> Answer:
        """The answer that the values `given` in a form mean.

        Raises:
            ValueError: they are no answer; its words say what to do.
        """
        raise NotImplementedError

    def as_sent(self, answer: Answer) -> dict[str, list[str]]:
        """The form fields that mean this answer."""
        if answer is None:
            return {}
        return {self.id: [str(one) for one in (answer if isinstance(answer, list) else [answer])]}

    def label_of(self, answer: Answer) -> str | None:
        """The words that were shown for an answer; None where it speaks for itself."""
        return None

    @property
    def choosable(self) -> tuple[str, ...]:
        """The answers that a condition may ask for; none if they are not given."""
        return ()

    @property
    def right(self) -> Answer:
        """The expected answer of a check; None for what is none."""
        expected: Answer | tuple[str, ...] = getattr(self, "expected", None)
        return list(expected) if isinstance(expected, tuple) else expected

    def passed(self, answer: Answer) -> bool | None:
        """Whether a check was answered as expected; None for what is no check or was not answered."""
        return None if self.right is None or answer is None else is_right(self.right, answer)

    @property
    def part(self) -> str:
        """The subscale that its answer counts in; empty if it counts in none."""
        return self.subscale if self.scores else ""

    def scored(self, answer: Answer) -> float | None:
        """What an answer counts in the subscale, turned round where the item is reversed."""
        return None

    def preference(self, answer: Answer) -> float | None:
        """How strongly the second partner (above 0) or the first (below 0) is preferred; None if open."""
        return None


def is_right(expected: object, answer: object) -> bool:
    """Whether an answer is the expected one; of several choices exactly those, in any order."""
    if isinstance(expected, list):
        return isinstance(answer, list) and sorted(answer) == sorted(expected)
    return answer == expected


def turned_round(answer: Answer, low: float, high: float, *, reversed_: bool) -> float | None:
    """A point between `low` and `high` as it counts in a subscale; None for what was not answered."""
    if not isinstance(answer, (int, float)):
        return None
    return float(low + high - answer if reversed_ else answer)


def cleaned(text: str) -> str:
    """Text as it may be stored: lines end in one newline, no control characters, no blanks around it."""
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return "".join(c for c in text if c == "\n" or unicodedata.category(c) not in ("Cc", "Cs")).strip()


def plain(number: float) -> str:
    """A number as people write it: no needless digits, and none left out."""
    return f"{number:.15g}"
