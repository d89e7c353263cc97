"""The drawings: well-formed, harmless, one for each thing, and the same everywhere they are named."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from galley.kitchen.codes import THINGS
from galley.server.templates import translated_templates
from galley.study.written.hats import HATS
from galley.study.written.texts import PICTURES, TILES
from tests.frontend.pages import FRONTEND, Page

DRAWINGS = sorted((FRONTEND / "sprites").glob("*.svg"))
NAMES = {path.stem for path in DRAWINGS}
SPRITES_JS = (FRONTEND / "js/sprites.js").read_text(encoding="utf-8")
SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("path", DRAWINGS, ids=lambda path: path.stem)
def test_a_drawing_is_well_formed_and_only_draws(path: Path) -> None:
    root = ElementTree.parse(path).getroot()
    assert root.tag == f"{SVG}svg"
    left, top, width, height = map(float, root.attrib["viewBox"].split())
    assert (left, top) == (0, 0)
    assert float(root.attrib["width"]) >= 192  # two device pixels for each of the largest tile
    assert abs(float(root.attrib["width"]) / float(root.attrib["height"]) - width / height) < 0.02
    for element in root.iter():
        assert element.tag.removeprefix(SVG) in {
            *("svg", "g", "path", "rect", "circle", "ellipse", "defs", "linearGradient", "stop"),
        }
        assert not [
            name for name in element.attrib if name.startswith("on") or "href" in name or name == "style"
        ]


def _hats_in_js() -> dict[str, tuple[str, str]]:
    row = r'"([a-z-]+)": \{ colour: "(#[0-9A-F]{6})", mark: "(\w+)" \}'
    return {name: (colour, mark) for name, colour, mark in re.findall(row, SPRITES_JS)}


def test_every_hat_of_a_study_is_drawn_in_its_own_colour_and_mark() -> None:
    hats = _hats_in_js()
    assert set(hats) == set(HATS)
    for part in range(2):
        assert len({hat[part] for hat in hats.values()}) == len(HATS)
    for name, (colour, _) in hats.items():
        assert colour in (FRONTEND / f"sprites/hat-{name}.svg").read_text(encoding="utf-8")
    assert {name.removeprefix("hat-") for name in NAMES if name.startswith("hat-")} == set(HATS)


@pytest.mark.parametrize("language", ["en", "zh"])
def test_every_hat_has_a_word_of_its_own_in_every_language(language: str) -> None:
    page = translated_templates(str(FRONTEND / "templates")).get_template("_hats.html")
    hats: Any = page.make_module({"language": language})
    words = {hats.word(name) for name in HATS}
    names = {Page(hats.partner(name, "1")).texts[-1] for name in HATS}
    assert len(words) == len(names) == len(HATS)
    assert not words & set(HATS) - {"orange", "blue", "yellow"}


def test_there_is_a_drawing_for_each_thing_in_the_order_of_its_code() -> None:
    (row,) = re.findall(r"const THINGS = .*?\(\[(.*?)\]\)", SPRITES_JS)
    drawn = [word.strip().strip('"') for word in row.split(",")]
    words = [" ".join(sorted(name.split("-"))) for name in drawn[1:]]
    assert words == [" ".join(sorted(name.replace("_", " ").split())) for name in THINGS[1:]]
    assert set(drawn[1:]) <= NAMES


def test_the_game_loads_every_drawing_and_only_those() -> None:
    block = SPRITES_JS[SPRITES_JS.index("const SIZES") : SPRITES_JS.index("const CHEF_PARTS")]
    sized = set(re.findall(r'"([a-z-]+)": \[', block))
    facings = ("north", "south", "east", "west")
    chefs = {f"{part}-{facing}" for part in ("chef", "cloth") for facing in facings}
    arms = {"chef-east-arm", "chef-west-arm"}
    assert sized | chefs | arms | {f"hat-{hat}" for hat in HATS} == NAMES


def test_pictures_in_texts_have_a_drawing() -> None:
    css = (FRONTEND / "css/pictures.css").read_text(encoding="utf-8")
    for picture in PICTURES:
        assert f".picture-{picture}" in css
    for classes in TILES.values():
        for name in classes.split():
            assert f".tile-{name}" in css or f".tile.{name}" in css
    assert set(re.findall(r'url\("\.\./sprites/([a-z-]+)\.svg"\)', css)) <= NAMES
