"""The colours of hats: as files name them, and the plain words by which participants know them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Literal, NamedTuple, get_args

from galley.translations import mark

Hat = Literal["orange", "sky-blue", "bluish-green", "yellow", "blue", "vermillion", "reddish-purple"]
HATS: Final[tuple[Hat, ...]] = get_args(Hat)
"""Colours that colour-blind people can tell apart. Source: Okabe and Ito, Color Universal Design (2008)."""


class HatWords(NamedTuple):
    """Messages of the catalogues: `colour` within a sentence, `hat` by itself."""

    colour: str
    hat: str


HAT_WORDS: Final[Mapping[Hat, HatWords]] = {
    "orange": HatWords(mark("orange"), mark("Orange hat")),
    "sky-blue": HatWords(mark("light blue"), mark("Light blue hat")),
    "bluish-green": HatWords(mark("green"), mark("Green hat")),
    "yellow": HatWords(mark("yellow"), mark("Yellow hat")),
    "blue": HatWords(mark("dark blue"), mark("Dark blue hat")),
    "vermillion": HatWords(mark("red"), mark("Red hat")),
    "reddish-purple": HatWords(mark("pink"), mark("Pink hat")),
}
"""The words of every colour."""
