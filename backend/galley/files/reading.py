"""The one loader for every YAML file that a person writes: all problems at once, with line and fix."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import pydantic
from pydantic_core import PydanticCustomError
from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.constructor import SafeConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from galley.errors import InvalidFiles, Problem
from galley.files.problems import explain

LARGEST_FILE_BYTES = 1_000_000
MOST_LEVELS = 50
MOST_NODES = 100_000
"""An alias counts each time it is used, so a file cannot unfold without end."""

MERGE = "tag:yaml.org,2002:merge"
"""The tag of a plain `<<`."""

Loc = tuple[str | int, ...]


class FileModel(pydantic.BaseModel):
    """Base of everything read from a file: unknown keys are refused and values never change."""

    model_config = pydantic.ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


M = TypeVar("M", bound=FileModel)


@dataclass(frozen=True)
class Loaded(Generic[M]):
    """A validated file that still knows on which line each of its keys stands."""

    value: M
    path: str
    lines: Mapping[Loc, int]
    text_lines: Mapping[Loc, int]

    def line(self, *loc: str | int) -> int:
        """The line (from 1) of a key path such as `("rounds", 0, "layout")`, or of what is around it."""
        return _line(self.lines, loc)

    def text_line(self, *loc: str | int, row: int) -> int:
        """The line of row `row` (from 0) of a block of text (`key: |`), else the line of the key."""
        return self.text_lines[loc] + row if loc in self.text_lines else self.line(*loc)

    def problem(self, loc: Loc, message: str, fix: str) -> Problem:
        """A problem of this file, at the line of a key path."""
        return Problem(self.path, self.line(*loc), message, fix)


def faults(problems: Iterable[tuple[Loc, str, str]]) -> PydanticCustomError:
    """What a validator of a `FileModel` raises: any number of (place below the value, message, fix)."""
    listed = list(problems)
    told = "; ".join(f"{message}; {fix}" for _, message, fix in listed)
    return PydanticCustomError("galley", "{told}", {"told": told, "problems": listed})


@dataclass(frozen=True)
class Document:
    """The keys and values of a file, not looked at by any model yet; `problems` are those of its text."""

    data: dict[str, Any]
    path: str
    lines: Mapping[Loc, int]
    text_lines: Mapping[Loc, int]
    problems: tuple[Problem, ...]

    def validated(self, model: type[M], context: Mapping[str, Any] | None = None) -> Loaded[M]:
        """The file as a validated `model`; validators get `context`.

        Raises:
            InvalidFiles: everything that is wrong with the file.
        """
        try:
            text = json.dumps(self.data)
            value = model.model_validate_json(text, strict=True, context=dict(context or {}))
        except pydantic.ValidationError as error:
            found = [
                Problem(self.path, _line(self.lines, loc), message, fix)
                for loc, message, fix in explain(error, model, self.data)
            ]
            raise InvalidFiles([*self.problems, *found]) from None
        if self.problems:
            raise InvalidFiles(self.problems)
        return Loaded(value, self.path, self.lines, self.text_lines)


def read(path: Path, shown: str | None = None) -> Document:
    """The file at `path` as plain keys and values; messages call it `shown`.

    Raises:
        InvalidFiles: the file is unreadable, not YAML, or holds no keys.
    """
    name = shown or path.as_posix()
    root = _compose(path, name)
    tree = _Tree(name)
    data = tree.value(root, ())
    if not isinstance(data, dict):
        fix = "write `key: value` lines"
        raise InvalidFiles([Problem(name, 1, "the file must hold keys and values at its top level", fix)])
    return Document(data, name, tree.lines, tree.text_lines, tuple(tree.problems))


def load(
    path: Path, model: type[M], shown: str | None = None, context: Mapping[str, Any] | None = None
) -> Loaded[M]:
    """The file at `path` as a validated `model`; messages call it `shown`, validators get `context`.

    Raises:
        InvalidFiles: everything that is wrong with the file: unreadable, not YAML, keys doubled, unknown or
            missing, values of a wrong type or out of range, and whatever the model's validators refuse.
    """
    return read(path, shown).validated(model, context)


def _line(lines: Mapping[Loc, int], loc: Loc) -> int:
    while loc and loc not in lines:
        loc = loc[:-1]
    return lines.get(loc, 1)


def _compose(path: Path, name: str) -> Node:
    try:
        raw = path.read_bytes()
    except OSError as error:
        told = f"cannot be read ({error.strerror or error})"
        fix = "check that the file is there and may be read"
        raise InvalidFiles([Problem(name, None, told, fix)]) from None
    if len(raw) > LARGEST_FILE_BYTES:
        told = f"the file has {len(raw)} bytes, more than {LARGEST_FILE_BYTES}"
        raise InvalidFiles([Problem(name, None, told, "make it smaller")])
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InvalidFiles([Problem(name, line, "the text is not UTF-8", "save the file as UTF-8")]) from None
    try:
        reader = YAML(typ="safe", pure=True)
        reader.Composer = _Composer
        root = reader.compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        told = ", ".join(part for part in (error.context, error.problem) if part)
        place = None if mark is None else mark.line + 1
        fix = "check indentation, colons and quotes on this line and the one before"
        raise InvalidFiles([Problem(name, place, f"not YAML: {told}", fix)]) from None
    except _TooDeepError as error:
        told = f"the file is nested more than {MOST_LEVELS} levels deep"
        fix = "write fewer lists and keys inside each other"
        raise InvalidFiles([Problem(name, error.line, told, fix)]) from None
    except (YAMLError, ValueError) as error:
        told = f"not YAML: {str(error).splitlines()[0]}"
        raise InvalidFiles([Problem(name, None, told, "keep to plain text")]) from None
    if root is None:
        raise InvalidFiles([Problem(name, 1, "the file is empty", "write its keys, or remove it")])
    document: Node = root
    return document


class _TooDeepError(Exception):
    """A node that lies too deep, found before what is below it is read."""

    def __init__(self, line: int) -> None:
        super().__init__(line)
        self.line = line


class _Composer(Composer):
    """Nodes from YAML, no deeper than anything that Galley reads."""

    depth = 0

    def compose_node(self, parent: Node | None, index: int) -> Any:
        self.depth += 1
        if self.depth > MOST_LEVELS:
            raise _TooDeepError(self.parser.peek_event().start_mark.line + 1)
        try:
            return super().compose_node(parent, index)
        finally:
            self.depth -= 1


class _Tree:
    """Plain JSON values from YAML nodes, and the lines where they stand."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.lines: dict[Loc, int] = {(): 1}
        self.text_lines: dict[Loc, int] = {}
        self.problems: list[Problem] = []
        self._nodes = 0
        self._scalars = SafeConstructor(loader=YAML(typ="safe", pure=True))

    def value(self, node: Node, loc: Loc) -> Any:
        self._nodes += 1
        if self._nodes > MOST_NODES or len(loc) > MOST_LEVELS:
            told = f"the file unfolds to more than {MOST_NODES} values or {MOST_LEVELS} levels"
            fix = "use fewer aliases (`*name`)"
            raise InvalidFiles([Problem(self.path, node.start_mark.line + 1, told, fix)])
        self.lines.setdefault(loc, node.start_mark.line + 1)
        if isinstance(node, MappingNode):
            return self._mapping(node, loc)
        if isinstance(node, SequenceNode):
            return [self.value(child, (*loc, place)) for place, child in enumerate(node.value)]
        return self._scalar(node, loc)

    def _mapping(self, node: MappingNode, loc: Loc) -> dict[str, Any]:
        values: dict[str, Any] = {}
        merged: list[Node] = []
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            if key_node.tag == MERGE:
                merged += value_node.value if isinstance(value_node, SequenceNode) else [value_node]
                continue
            if not isinstance(key_node, ScalarNode):
                self.problems.append(Problem(self.path, line, "a key must be one word", "write `key: value`"))
                continue
            key = str(key_node.value)
            if key in values:
                told = f"key '{key}' stands here again (first on line {self.lines[(*loc, key)]})"
                self.problems.append(Problem(self.path, line, told, "keep one of the two"))
                continue
            self.lines[(*loc, key)] = line
            values[key] = self.value(value_node, (*loc, key))
        for other in merged:
            self._merge(other, loc, values)
        return values

    def _merge(self, node: Node, loc: Loc, values: dict[str, Any]) -> None:
        """Add what a `<<` brings; keys that are there already stay.

        Source: https://yaml.org/type/merge.html.
        """
        if not isinstance(node, MappingNode):
            line = node.start_mark.line + 1
            told = "'<<' takes keys and values from elsewhere, and this is none"
            self.problems.append(
                Problem(self.path, line, told, "name an anchor of keys and values: `<<: *name`")
            )
            return
        lines = dict(self.lines)
        for key, value in self._mapping(node, loc).items():
            values.setdefault(key, value)
        self.lines |= lines

    def _scalar(self, node: Node, loc: Loc) -> Any:
        if isinstance(node, ScalarNode) and node.style in ("|", ">"):
            self.text_lines[loc] = node.start_mark.line + 2
        try:
            value = self._scalars.construct_object(node)
        except (YAMLError, ValueError) as error:
            told = f"value '{node.value}' cannot be read ({str(error).splitlines()[0]})"
            self.problems.append(Problem(self.path, node.start_mark.line + 1, told, "put it in quotes"))
            return node.value
        return value if isinstance(value, (str, int, float, bool)) or value is None else str(node.value)
