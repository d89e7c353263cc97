"""The film's numbers are those of the browser's drawing."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from galley.film import sizes
from galley.workspace import frontend_folder

FOLDER = frontend_folder()
FILES = {
    "backdrop.js": ("WALL", "CORNER"),
    "sprites.js": ("FACINGS", "THINGS", "STATIONS", "SIZES", "CHEF_SIZE", "HAT_BOX"),
    "draw.js": ("STAND", "FEET", "SHRINK", "HANDS", "HELD_SIZE"),
    "motion.js": ("TOWARDS", "BUMP_MS", "BUMP_TILES", "BOB_TILES"),
    "board.js": ("EFFECT_MS",),
}


def constant(file: str, name: str) -> Any:
    """The value of a constant in a script of the browser."""
    text = (FOLDER / "js" / file).read_text(encoding="utf-8")
    (found,) = re.findall(rf"^(?:export )?const {name} = (.*?);$", text, re.MULTILINE | re.DOTALL)
    plain = re.sub(r"/\*\*.*?\*/|Object\.freeze|[()]|\s+", " ", found).strip()
    plain = re.sub(r"(\w+): ", r'"\1": ', plain) if name == "STATIONS" else plain
    plain = plain.replace("0.7 * 62 / 80", repr(0.7 * 62 / 80))
    return json.loads(re.sub(r",\s*([}\]])", r"\1", plain))


def listed(value: Any) -> Any:
    return json.loads(json.dumps(value))


@pytest.mark.parametrize(("file", "name"), [(file, name) for file, names in FILES.items() for name in names])
def test_a_number_is_the_browsers(file: str, name: str) -> None:
    assert constant(file, name) == listed(getattr(sizes, name))


def test_hats_have_the_browsers_colours() -> None:
    text = (FOLDER / "js/sprites.js").read_text(encoding="utf-8")
    assert dict(re.findall(r'"([\w-]+)": \{ colour: "(#\w+)"', text)) == sizes.HATS
