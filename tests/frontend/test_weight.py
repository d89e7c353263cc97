"""What a page weighs before anything is drawn, and that its scripts and styles stay on this host."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.frontend.pages import FRONTEND, Page, contexts, render

FIRST_PAINT_BYTES = 100 * 1024
CODE = sorted([*(FRONTEND / "js").glob("*.js"), *(FRONTEND / "css").glob("*.css")])


def _with_imports(path: Path, seen: set[Path]) -> set[Path]:
    if path not in seen:
        seen.add(path)
        for name in re.findall(r'^import .*?from "(\./[\w-]+\.js)";', path.read_text(encoding="utf-8"), re.M):
            _with_imports((path.parent / name).resolve(), seen)
    return seen


@pytest.mark.parametrize("name", sorted(contexts()))
def test_first_paint_without_drawings_is_light(name: str) -> None:
    html = render(name, "About as many words as a study has.")
    page = Page(html)
    files: set[Path] = set()
    for attrs in page.all("link", rel="stylesheet"):
        files.add(FRONTEND / attrs["href"].removeprefix("/static/"))
    for script in page.scripts:
        _with_imports(FRONTEND / script, files)
    assert files
    assert len(html.encode()) + sum(file.stat().st_size for file in files) < FIRST_PAINT_BYTES


@pytest.mark.parametrize("path", CODE, ids=lambda path: path.name)
def test_code_stays_small_and_on_this_host(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 500
    assert re.findall(r"(?:https?:)?//[a-z]+\.[a-z]", text) == []
    assert not re.search(r"\beval\(|new Function|innerHTML|document\.write|@import", text)


def test_every_script_is_reached_from_a_page() -> None:
    reached: set[Path] = set()
    for name in contexts():
        for script in Page(render(name)).scripts:
            _with_imports(FRONTEND / script, reached)
    assert reached == set((FRONTEND / "js").glob("*.js"))
