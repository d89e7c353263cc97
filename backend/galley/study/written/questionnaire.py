"""Questionnaires, and the answers that fit them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from galley.errors import Problem
from galley.files.reading import FileModel, Loaded, Loc, faults, load, read
from galley.study.written.item_base import BYTES_PER_CHARACTER, Answer, Say
from galley.study.written.items import Item
from galley.study.written.languages import LanguageCode, Text, Words

RESERVED_IDS = ("step",)
"""Names of form fields that the pages need themselves."""


class Questionnaire(FileModel):
    """A questionnaire file: its title and items in order, and where they come from."""

    format: Literal[1]
    """Version of this kind of file."""
    title: Text
    """The heading of its page."""
    source: Text
    """Where its items come from."""
    language: LanguageCode | None = None
    """The language of words that are given once; without it, that of the study."""
    translations: Annotated[str, Field(max_length=2000)] = ""
    """Where translations are published, or why there are none: `galley check` tells it with what lacks."""
    intro: Words = ""
    """Words above the items."""
    order: Literal["fixed", "random"] = "fixed"
    """Items as written, or shuffled for each visit; an item with `when` stays behind the one it asks for."""
    items: tuple[Item, ...] = Field(min_length=1, max_length=300)
    """The items, see below."""

    @field_validator("items")
    @classmethod
    def _items_fit_together(cls, items: tuple[Item, ...]) -> tuple[Item, ...]:
        found = _faults_between(items)
        if found:
            raise faults(found)
        return items

    @property
    def expected(self) -> dict[str, Any]:
        """The right answer of every item that has one."""
        return {item.id: item.right for item in self.items if item.right is not None}

    @property
    def form_size(self) -> tuple[int, int]:
        """(bytes, fields) of the largest form that a browser may send of it."""
        fields = [field for item in self.items for field in item.longest_fields()]
        most = sum(len(name) + 2 + BYTES_PER_CHARACTER * characters for name, characters in fields)
        return most, len(fields)

    def arranged(self, item_order: Sequence[str]) -> Questionnaire:
        """The same questionnaire with those of its items that have these ids, in this order."""
        by_id = {item.id: item for item in self.items}
        return self.model_copy(update={"items": tuple(by_id[name] for name in item_order if name in by_id)})

    def expecting(self, right: Mapping[str, Any]) -> Questionnaire:
        """The same questionnaire with these right answers, by item, in place of its own."""
        if right == self.expected:
            return self
        items = (
            item.model_copy(update={"expected": _frozen(right.get(item.id))})
            if hasattr(item, "expected")
            else item
            for item in self.items
        )
        return self.model_copy(update={"items": tuple(items)})


def _frozen(answer: Any) -> Any:
    return tuple(answer) if isinstance(answer, list) else answer


def load_questionnaire(
    path: Path, shown: str | None = None, context: Mapping[str, Any] | None = None
) -> Loaded[Questionnaire]:
    """The questionnaire in a file; `context` may hold the `language` to read and all `languages` wanted.

    Raises:
        InvalidFiles: everything that is wrong with it.
    """
    return load(path, Questionnaire, shown, context)


def why_not_in(language: str, path: Path, shown: str, problems: Iterable[Problem]) -> Iterator[Problem]:
    """What a file says of its translations, where `problems` say that it has no words in a language."""
    lacking = sum(f"no words in '{language}'" in problem.message for problem in problems)
    if not lacking:
        return
    document = read(path, shown)
    told = document.data.get("translations")
    if isinstance(told, str):
        count = f"{lacking} of its texts are not in '{language}'"
        yield Problem(
            shown, document.lines[("translations",)], f"{count}: {told.rstrip('.')}", "translate them"
        )


def validate_answers(
    questionnaire: Questionnaire, form: Mapping[str, Sequence[str]], say: Say = str
) -> tuple[dict[str, Answer], dict[str, str]]:
    """(answers, problems) of a submitted form; the answers count only if there are no problems.

    `form` maps a field name to its values as sent; names that are no item are ignored. Answers have every
    item: a scale's point as int (its number), a choice as the option's value, several as a list in the
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
        given = item.given(form)
        if not any(given):
            if item.required:
                problems[item.id] = say(item.missing)
            continue
        if len(given) > 1 and not item.many_values:
            problems[item.id] = say("Please give one answer only.")
            continue
        try:
            answers[item.id] = item.answer(given, say)
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


def verdicts(questionnaire: Questionnaire, answers: Mapping[str, Answer]) -> dict[str, bool]:
    """Whether each attention check (item with `expected`) that was asked was answered as expected."""
    found = {
        item.id: item.passed(answers.get(item.id)) for item in questionnaire.items if asked(item, answers)
    }
    return {item: passed for item, passed in found.items() if passed is not None}


def failed_checks(questionnaire: Questionnaire, answers: Mapping[str, Answer]) -> tuple[str, ...]:
    """The ids of the attention checks that were answered otherwise than expected."""
    return tuple(item for item, passed in verdicts(questionnaire, answers).items() if not passed)


def _faults_between(items: Sequence[Item]) -> list[tuple[Loc, str, str]]:
    """What is wrong between the items of one file: ids that stand twice, conditions on what was not asked."""
    found: list[tuple[Loc, str, str]] = []
    choices: dict[str, tuple[str, ...]] = {}
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
        if item.choosable:
            choices[item.id] = item.choosable
        if item.right is not None and not item.required:
            told = f"item '{item.id}' has an expected answer but need not be answered"
            found.append(((place, "required"), told, "remove `required: false`, or the expected answer"))
        seen.add(item.id)
    return found
