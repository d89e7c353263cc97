"""The pages on the kitchen hold the same tables as the code."""

from __future__ import annotations

import re
from pathlib import Path

from galley.kitchen import ENCODINGS, EVENTS
from galley.kitchen.layout import Rules
from galley.kitchen.layout_file import LayoutFile, RulesFile
from galley.kitchen.measures import Measures

DOCS = Path(__file__).resolve().parents[2] / "docs"


def rows(page: str, heading: str) -> dict[str, str]:
    """First and last cell of the table that follows `heading`, by every name in the first cell."""
    text = (DOCS / page).read_text(encoding="utf-8")
    table = text.split(heading, 1)[1].split("\n\n", 1)[0] if heading in text else ""
    found = {}
    for line in table.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        for name in re.findall(r"`([^`]+)`", cells[0]):
            found[name] = cells[-1]
    return found


def test_events() -> None:
    assert rows("rules.md", "| kind | meaning |") == EVENTS


def test_measures() -> None:
    assert set(rows("rules.md", "| measure | meaning |")) == set(Measures.__dataclass_fields__)


def test_encodings() -> None:
    text = (DOCS / "rules.md").read_text(encoding="utf-8")
    assert re.findall(r"^### `([^`]+)`$", text, re.MULTILINE) == list(ENCODINGS)


def test_layout_file() -> None:
    assert set(rows("add-a-layout.md", "| key | meaning |")) == set(LayoutFile.model_fields)
    assert set(rows("add-a-layout.md", "| rule | default | meaning |")) == set(RulesFile.model_fields)
    assert RulesFile() == RulesFile(**vars(Rules()))
