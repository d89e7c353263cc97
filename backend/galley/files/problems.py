"""What pydantic found wrong with a file, in words that a researcher can act on."""

from __future__ import annotations

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import pydantic
from pydantic_core import ErrorDetails

from galley.names import name_fix, nearest

Loc = tuple[str | int, ...]

_UNIONS = (Union, UnionType)
_WANTED = {
    "int": "a whole number",
    "float": "a number",
    "string": "text",
    "bool": "true or false",
    "list": "a list (`- ...` lines)",
    "tuple": "a list (`- ...` lines)",
    "frozen_set": "a list (`- ...` lines)",
    "set": "a list (`- ...` lines)",
    "dict": "keys and values",
    "model": "keys and values",
    "model_attributes": "keys and values",
    "none_required": "nothing",
}


def explain(
    error: pydantic.ValidationError, model: type[pydantic.BaseModel], data: Any
) -> Iterator[tuple[Loc, str, str]]:
    """(place in the file, what is wrong, how to fix it) for each error of validating `data` as `model`."""
    for detail in error.errors(include_url=False):
        if detail["type"] == "too_short" and len(detail["input"]) >= detail["ctx"]["min_length"]:
            continue  # pydantic counts valid members only; the invalid ones tell their own story
        loc = _place(detail["loc"], data, missing=detail["type"] == "missing")
        if detail["type"] == "galley":
            for below, message, fix in detail["ctx"]["problems"]:
                yield (*loc, *below), message, fix
        else:
            yield loc, *_words(detail, loc, model)


def _place(loc: Loc, data: Any, *, missing: bool) -> Loc:
    """The key path in the file: without the tags of unions, with the name of a `missing` key at its end."""
    path: list[str | int] = []
    for index, part in enumerate(loc):
        inside = (isinstance(data, dict) and part in data) or (
            isinstance(data, list) and isinstance(part, int) and part < len(data)
        )
        if inside:
            data = data[part]
        if inside or (missing and index == len(loc) - 1):
            path.append(part)
    return tuple(path)


def _words(detail: ErrorDetails, loc: Loc, model: type[pydantic.BaseModel]) -> tuple[str, str]:
    kind, ctx = detail["type"], detail.get("ctx", {})
    key = _told(loc)
    got = _value(detail["input"])
    match kind:
        case "missing":
            return f"key '{detail['loc'][-1]}' is missing{_within(loc)}", f"add `{detail['loc'][-1]}: ...`"
        case "extra_forbidden":
            name = str(detail["loc"][-1])
            known = _known_keys(model, detail["loc"][:-1])
            return f"key '{name}' is unknown{_within(loc)}", name_fix(name, known)
        case "literal_error" | "enum":
            return f"{key} {got} is unknown", f"use one of {str(ctx['expected']).replace(' or ', ', ')}"
        case "union_tag_invalid":
            tag = str(ctx["discriminator"]).strip("'")
            known = [name.strip(" '") for name in str(ctx["expected_tags"]).split(",")]
            return f"{tag} '{ctx['tag']}' is unknown{_within((*loc, ''))}", name_fix(ctx["tag"], known)
        case "union_tag_not_found":
            tag = str(ctx["discriminator"]).strip("'")
            told = f"key '{tag}' is missing{_within((*loc, ''))}"
            meant = _meant(tag, detail["input"], _members(model, detail["loc"]))
            if meant is not None:
                return f"{told}, and '{meant}' is unknown there", f"write `{tag}: ...` in its place"
            return told, f"add `{tag}: ...`"
        case "greater_than_equal" | "greater_than" | "less_than_equal" | "less_than":
            words = {"ge": "at least", "gt": "more than", "le": "at most", "lt": "less than"}
            name, limit = next((name, ctx[name]) for name in words if name in ctx)
            return f"{key} {got} is out of range", f"it must be {words[name]} {limit}"
        case "too_short" | "string_too_short":
            return f"{key} is too short", f"it needs at least {ctx.get('min_length')}"
        case "too_long" | "string_too_long":
            return f"{key} is too long", f"it may have at most {ctx.get('max_length')}"
        case "string_pattern_mismatch":
            return f"{key} {got} has a form that is not allowed", f"it must match {ctx['pattern']}"
        case "value_error":
            return f"{key}: {ctx['error']}", "change it"
        case "int_from_float":
            return f"{key} must be a whole number, not {got}", "leave out the fraction"
    for ending in ("_type", "_parsing"):
        wanted = _WANTED.get(kind.removesuffix(ending))
        if kind.endswith(ending) and wanted is not None:
            fix = "put it in quotes" if wanted == "text" and not got.startswith("'") else f"write {wanted}"
            return f"{key} must be {wanted}, not {got}", fix
    return f"{key}: {detail['msg']}", "change it"


def _meant(tag: str, given: Any, members: list[Any]) -> str | None:
    """The unknown key that stands where `tag` should: spelt nearly so, or with one of the values of `tag`."""
    known = {key for member in members for key in member.model_fields}
    keys = [str(key) for key in given if key not in known] if isinstance(given, dict) else []
    values = {value for member in members for value in _tags(member)[1:]}
    by_value = (key for key in keys if isinstance(given[key], str) and given[key] in values)
    return nearest(tag, keys) or next(by_value, None)


def _members(model: Any, loc: Loc) -> list[Any]:
    """The models of the union at `loc`."""
    for part in loc:
        model = _below(model, part)
    return [_bare(member) for member in get_args(_only(model))]


def _told(loc: Loc) -> str:
    """`'items' no. 2, 'scale'` for the key path `("items", 1, "scale")`."""
    parts: list[str] = []
    for part in loc:
        if isinstance(part, int) and parts:
            parts[-1] += f" no. {part + 1}"
        else:
            parts.append(f"'{part}'")
    return ", ".join(parts) or "the file"


def _within(loc: Loc) -> str:
    return f" in {_told(loc[:-1])}" if len(loc) > 1 else ""


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "keys and values"
    if isinstance(value, list):
        return "a list"
    if value is None:
        return "nothing"
    text = str(value).lower() if isinstance(value, bool) else str(value)
    text = text if len(text) <= 40 else text[:37] + "..."
    return f"'{text}'" if isinstance(value, str) else text


def _known_keys(model: Any, loc: Loc) -> list[str]:
    """The keys that the model found at `loc` (pydantic's, with tags of unions) understands."""
    for part in loc:
        model = _below(model, part)
    model = _only(model)
    if isinstance(model, type) and issubclass(model, pydantic.BaseModel):
        return [field.alias or name for name, field in model.model_fields.items()]
    return []


def _below(annotation: Any, part: str | int) -> Any:
    annotation = _only(annotation)
    origin = get_origin(annotation)
    if origin in _UNIONS:
        return next((member for member in map(_bare, get_args(annotation)) if part in _tags(member)), None)
    if origin is dict:
        return get_args(annotation)[1]
    if origin in (list, tuple, set, frozenset):
        return get_args(annotation)[0]
    if isinstance(annotation, type) and issubclass(annotation, pydantic.BaseModel):
        for name, field in annotation.model_fields.items():
            if part in (name, field.alias):
                # pydantic keeps a discriminator beside the annotation, so the union is still there to walk.
                return field.annotation
    return None


def _only(annotation: Any) -> Any:
    """The annotation itself, or X for `X | None`."""
    annotation = _bare(annotation)
    if get_origin(annotation) in _UNIONS:
        members = [member for member in get_args(annotation) if member is not type(None)]
        return _bare(members[0]) if len(members) == 1 else annotation
    return annotation


def _bare(annotation: Any) -> Any:
    if hasattr(annotation, "__value__"):
        annotation = annotation.__value__
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    return annotation


def _tags(member: Any) -> list[Any]:
    """The literal values by which a union tells its members apart, and the member's own name."""
    if get_origin(member) in (list, tuple):
        return ["list"]
    if not (isinstance(member, type) and issubclass(member, pydantic.BaseModel)):
        return []
    literals = (field.annotation for field in member.model_fields.values())
    return [member.__name__, *(value for a in literals if get_origin(a) is Literal for value in get_args(a))]
