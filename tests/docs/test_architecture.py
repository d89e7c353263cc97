"""docs/architecture.md leads to files that are there, and to names that are in them."""

from __future__ import annotations

import re
from pathlib import Path

from tests.docs.structure import PACKAGE, ROOT

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
ROWS = [line for line in PAGE.splitlines() if line.startswith("| ") and "`" in line]
ENDINGS = (".py", ".js", ".html", ".md", "/")


def place(path: str) -> Path:
    """Where a path of the page lies: below the package, else below the project."""
    inside = PACKAGE / path
    return inside if inside.exists() else ROOT / path


def paths(line: str) -> list[str]:
    return [word for word in re.findall(r"`([^`]+)`", line) if word.endswith(ENDINGS) and "<" not in word]


def test_every_file_of_the_page_is_there() -> None:
    found = {path for line in PAGE.splitlines() for path in paths(line) if "/" in path}
    assert len(found) > 60
    assert not [path for path in sorted(found) if not place(path).exists()]


def test_every_name_stands_in_a_file_of_its_row() -> None:
    wrong, looked_for = [], 0
    for row in ROWS:
        files = [place(path) for path in paths(row) if path.endswith((".py", ".js"))]
        texts = [file.read_text(encoding="utf-8") for file in files if file.is_file()]
        for name in re.findall(r"`([A-Za-z_][\w.]*)`", row):
            if name.endswith(ENDINGS):
                continue
            looked_for += 1
            parts = name.split(".")
            if not any(
                all(
                    re.search(rf"^\s*(?:async def|def|class|function) {part}\b", text, re.MULTILINE)
                    for part in parts
                )
                for text in texts
            ):
                wrong.append(f"{name}: not in {[str(file) for file in files]}")
    assert looked_for >= 10
    assert not wrong, "\n".join(wrong)


def test_the_walks_are_short() -> None:
    walks = {
        title: re.findall(r"^\| `", text, re.MULTILINE)
        for title, text in re.findall(r"^## (.+)\n((?:(?!^## ).*\n)*)", PAGE, re.MULTILINE)
    }
    study = next(rows for title, rows in walks.items() if title.startswith("A study file"))
    assert len(study) <= 14
