"""The page of the command line, made from the commands themselves.

`python -m tests.docs.reference` prints docs/command-line.md; a test compares the two.
"""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import typer
from typer.models import ArgumentInfo, OptionInfo

from galley.cli import app

HEAD = """# Command line

Made from the commands themselves by `python -m tests.docs.reference > docs/command-line.md`.
A user's mistake is told in one line per problem and exits with 1; wrong usage exits with 2.
"""


@dataclass(frozen=True)
class Parameter:
    """One argument or option of a command."""

    shown: str
    flag: str | None
    takes_value: bool
    required: bool
    help: str
    default: str


def commands(group: typer.Typer = app, path: str = "galley") -> Iterator[tuple[str, Callable[..., None]]]:
    """Yield the full path and the function of every command."""
    for command in group.registered_commands:
        assert command.callback is not None
        yield f"{path} {command.name or command.callback.__name__}", command.callback
    for below in group.registered_groups:
        assert below.typer_instance is not None
        yield from commands(below.typer_instance, f"{path} {below.name}")


def parameters(function: Callable[..., None]) -> list[Parameter]:
    """Return the arguments and options of one command, in its order."""
    hints = typing.get_type_hints(function, include_extras=True)
    return [_parameter(p, hints[p.name]) for p in inspect.signature(function).parameters.values()]


def _parameter(parameter: inspect.Parameter, hint: object) -> Parameter:
    kind, info = typing.get_args(hint)[:2]
    required = parameter.default is inspect.Parameter.empty
    default = "" if required or parameter.default in (None, False) else f"`{parameter.default}`"
    if isinstance(info.show_default, str):
        default = info.show_default
    if isinstance(info, ArgumentInfo):
        name = info.metavar or parameter.name.upper()
        return Parameter(name if required else f"[{name}]", None, False, required, info.help or "", default)
    assert isinstance(info, OptionInfo)
    # Inside Annotated, typer reads the first string as a name of the option.
    named = info.default if isinstance(info.default, str) else "--" + parameter.name.replace("_", "-")
    flag = next(iter(info.param_decls or ()), named)
    names = {int: " N", bool: ""}
    shown = flag + names.get(kind, f" {info.metavar or flag.strip('-').upper()}")
    return Parameter(shown, flag, kind is not bool, required, info.help or "", default)


def page() -> str:
    """Return docs/command-line.md in full."""
    parts = [HEAD]
    for path, function in commands():
        listed = parameters(function)
        usage = " ".join([path, *(p.shown for p in listed if p.flag is None or p.required)])
        parts.append(f"## {path}\n\n```sh\n{usage}\n```\n\n{inspect.getdoc(function)}\n")
        rows = [f"| `{p.shown}` | {p.help} | {p.default} |" for p in listed]
        parts.append("| | | default |\n|---|---|---|\n" + "\n".join(rows) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    print(page(), end="")
