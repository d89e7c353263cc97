"""The page of study files, its tables made from the models themselves.

`python -m tests.study.reference` prints docs/study-files.md; a test compares the two.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from galley.files.reading import FileModel
from galley.study.stages import rounds, stage_kinds
from galley.study.written import factors, item_base, items, languages, questionnaire, recruitment
from galley.study.written import study_file as config
from tests.study.workspaces import ROOT

PAGE = ROOT / "docs" / "study-files.md"
WORDS = ROOT / "tests" / "study" / "study-files.in.md"
"""The page without its tables: a line `{{ Model }}` stands for the table of a model."""

STAGES = stage_kinds.STAGE_KINDS
ITEMS = get_args(get_args(items.Item)[0])
PARTS = (
    *(config.StudyFile, rounds.Kitchen, rounds.Lobby, factors.Factor, factors.Condition),
    *(recruitment.Completion, recruitment.EndingFile, recruitment.Endings),
    *(
        recruitment.Attention,
        recruitment.Recruitment,
        questionnaire.Questionnaire,
        item_base.Option,
        item_base.When,
    ),
)
MODELS: dict[str, type[FileModel]] = {model.__name__: model for model in (*PARTS, *STAGES)}
MODELS |= {f"Item{model.__name__}": model for model in ITEMS}
COMMON = {
    "Stage": stage_kinds.Instructions.model_fields.keys() - {"kind", "text"},
    "Item": items.ShortText.model_fields.keys() - {"kind", "max_length"},
}
"""Keys that stand in a table of their own, once for all stages and once for all items."""


def page() -> str:
    """docs/study-files.md in full."""
    return re.sub(r"\{\{ (\w+) \}\}", lambda place: _table(place[1]), WORDS.read_text(encoding="utf-8"))


def _items() -> str:
    """Every kind of item: its docstring, what is stored, its keys."""
    told = []
    for model in ITEMS:
        kind = get_args(model.model_fields["kind"].annotation)[0]
        heading = "comparison of partners" if kind == "comparison" else kind  # a stage has that name too
        words = [f"### {heading}", inspect.getdoc(model), f"Stored: {model.stored}.", _rows(_own(model))]
        told.append("\n\n".join(str(part) for part in words))
    return "\n\n".join(told)


def _stages() -> str:
    """Every kind of stage: its docstring, its keys."""
    return "\n\n".join(
        f"### {get_args(model.model_fields['kind'].annotation)[0]}\n\n{inspect.getdoc(model)}\n\n"
        + _table(model.__name__)
        for model in STAGES
    )


def _table(name: str) -> str:
    if name == "Items":
        return _items()
    if name == "Stages":
        return _stages()
    if name in COMMON:
        model: type[FileModel] = stage_kinds.Instructions if name == "Stage" else items.ShortText
        fields = {key: field for key, field in model.model_fields.items() if key in COMMON[name]}
        return _rows(fields)
    return _rows(_own(MODELS[name]))


def _own(model: type[FileModel]) -> dict[str, FieldInfo]:
    """The keys of a model that are not told once for all."""
    shared = COMMON["Item"] if model in ITEMS else COMMON["Stage"] if model in STAGES else set()
    return {
        key: field
        for key, field in model.model_fields.items()
        if key != "kind" and (key not in shared or field.is_required() or _overrides(model, key))
    }


def _overrides(model: type[FileModel], key: str) -> bool:
    """Whether a model says something of its own on a key that others have too."""
    return key in inspect.get_annotations(model)


def _rows(fields: dict[str, FieldInfo]) -> str:
    lines = ["| key | meaning | values | default |", "|---|---|---|---|"]
    lines += [
        f"| `{key}` | {' '.join(str(field.description).split())} | {_values(field)} | {_default(field)} |"
        for key, field in fields.items()
    ]
    return "\n".join(lines)


def _values(field: FieldInfo) -> str:
    found = list(dict.fromkeys(_kinds(field.annotation)))
    limits = [_limit(rule) for rule in field.metadata]
    if field.annotation in (str,) and languages.SAID_IN_LANGUAGES in field.metadata:
        found, limits = ["words"], []
    inner = [rule for part in _parts(field.annotation) for rule in getattr(part, "metadata", ())]
    limits += [_limit(rule) for rule in inner]
    return ", ".join([*found, *(limit for limit in limits if limit)])


def _parts(annotation: Any) -> Iterator[Any]:
    if get_origin(annotation) is Annotated:
        for rule in get_args(annotation)[1:]:
            if isinstance(rule, FieldInfo):
                yield rule
    elif get_origin(annotation) in (Union, UnionType):
        for member in get_args(annotation):
            yield from _parts(member)


def _kinds(annotation: Any) -> Iterator[str]:
    origin = get_origin(annotation)
    if origin is Annotated:
        base, *rules = get_args(annotation)
        patterned = any(isinstance(rule, FieldInfo) and "anyOf" in str(rule) for rule in rules)
        if languages.SAID_IN_LANGUAGES in rules or patterned:
            yield "words"
        else:
            yield from _kinds(base)
    elif origin in (Union, UnionType):
        for member in get_args(annotation):
            if member is not NoneType:
                yield from _kinds(member)
    elif origin is Literal:
        yield from (
            f"`{json.dumps(value) if isinstance(value, bool) else value}`" for value in get_args(annotation)
        )
    elif origin is tuple:
        inner = ", ".join(dict.fromkeys(_kinds(get_args(annotation)[0])))
        yield f"a list of {inner}" if inner else "a list"
    elif origin is dict:
        yield f"names, each with {', '.join(_kinds(get_args(annotation)[1]))}"
    elif isinstance(annotation, type) and issubclass(annotation, FileModel):
        yield _anchor(annotation)
    else:
        plain = {int: "whole number", float: "number", bool: "`true`, `false`", str: "text"}
        yield plain.get(annotation, "text")


def _anchor(model: type[FileModel]) -> str:
    headings = {
        "Kitchen": "layouts of rounds",
        "Lobby": "rounds with another participant",
        "Factor": "balance",
        "Condition": "conditions",
        "Option": "options",
        "When": "conditions on items",
        "EndingFile": "endings",
        "Endings": "endings",
        "Completion": "endings",
        "Attention": "attention checks",
        "Recruitment": "recruitment",
    }
    heading = headings.get(model.__name__, "items" if model in ITEMS else "stages")
    return f"[{heading}](#{heading.replace(' ', '-')})"


def _limit(rule: Any) -> str:
    words = {"ge": "from", "gt": "above", "le": "to", "lt": "below"}
    for name, word in words.items():
        value = getattr(rule, name, None)
        if value is not None:
            return f"{word} {value:g}" if value < 2**60 else f"{word} 2^63"
    return ""


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "needed"
    value = field.get_default(call_default_factory=True)
    if value is None or value in ("", (), {}) or isinstance(value, FileModel):
        return ""
    if isinstance(value, tuple):
        return " ".join(f"`{one}`" for one in value)
    return f"`{json.dumps(value) if isinstance(value, (bool, int, float)) else value}`"


if __name__ == "__main__":
    print(page(), end="")
