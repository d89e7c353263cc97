"""The structure of the code as it is: packages with what they hold, and the layers that the contracts name.

`python -m tests.docs.structure > docs/layers.md` brings the page up to date.
"""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "backend" / "galley"

HEAD = """# Who may import whom

A package imports what stands below it, never what stands beside or above it; what stands in one row does
not know its neighbours. `make lint` holds this: the contracts are in `pyproject.toml`, and this page is drawn
from them.

| layer | holds |
|---|---|
"""

FOOT = """
Besides:

"""


def contracts() -> list[dict[str, object]]:
    """The contracts of import-linter, in order."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    found: list[dict[str, object]] = settings["tool"]["importlinter"]["contracts"]
    return found


def layers() -> list[list[str]]:
    """The names of each layer, from the top."""
    held = next(contract["layers"] for contract in contracts() if contract["type"] == "layers")
    assert isinstance(held, list)
    return [[name.strip(" ()") for name in layer.split("|")] for layer in held]


def modules() -> Iterator[Path]:
    """Every Python file of the package, migrations included."""
    return (path for path in sorted(PACKAGE.rglob("*.py")) if "__pycache__" not in path.parts)


def says(name: str) -> str:
    """The first paragraph of a package's or module's docstring, on one line."""
    path = PACKAGE / name
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    first = (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").split("\n\n")[0]
    return " ".join(first.split())


def page() -> str:
    """docs/layers.md as it should be."""
    rows = []
    for layer in layers():
        names = ", ".join(f"`{name}`" for name in layer)
        told = " ".join(f"`{name}`: {says(name)}" if len(layer) > 1 else says(name) for name in layer)
        rows.append(f"| {names} | {told} |\n".replace("|  |", "| |"))
    besides = [f"- {contract['name']}\n" for contract in contracts() if contract["type"] != "layers"]
    return HEAD + "".join(rows) + FOOT + "".join(besides)


if __name__ == "__main__":
    print(page(), end="")
