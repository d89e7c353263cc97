"""Where everything is drawn and how large, in tiles: the numbers of the browser's drawing.

They stand in frontend/js under the same names; tests/film holds both to the same values.
"""

from __future__ import annotations

from typing import Final

# backdrop.js
WALL: Final = 0.4
CORNER: Final = 0.17

# sprites.js
FACINGS: Final = ("north", "south", "east", "west")
HATS: Final = {
    "orange": "#E69F00",
    "sky-blue": "#56B4E9",
    "bluish-green": "#009E73",
    "vermillion": "#D55E00",
    "blue": "#0072B2",
    "reddish-purple": "#CC79A7",
    "yellow": "#F0E442",
}
THINGS: Final = (None, "onion", "tomato", "dish", "soup-onion", "soup-tomato")
STATIONS: Final = {"P": "stove", "O": "onion-crate", "T": "tomato-crate", "D": "dish-rack", "S": "hatch"}
SIZES: Final = {
    "floor": (1, 1),
    "floor-dark": (1, 1),
    "counter": (1, 1),
    "front": (1, 1),
    "wall": (1, 0.4),
    "stove": (1, 1),
    "stove-front": (1, 1),
    "onion-crate": (1, 1),
    "tomato-crate": (1, 1),
    "dish-rack": (1, 1),
    "hatch": (1, 1),
    "pot": (0.84, 0.84),
    "broth-onion": (0.84, 0.84),
    "broth-tomato": (0.84, 0.84),
    "flame": (0.24, 0.24),
    "steam": (0.5, 0.5),
    "ready": (0.36, 0.36),
    "onion": (0.62, 0.62),
    "tomato": (0.62, 0.62),
    "dish": (0.66, 0.66),
    "soup-onion": (0.7, 0.7),
    "soup-tomato": (0.7, 0.7),
}
CHEF_SIZE: Final = (1, 1.4)
HAT_BOX: Final = (0.15, 0.02, 0.7, 0.7 * 62 / 80)

# draw.js
STAND: Final = 0.9
FEET: Final = 1.31
SHRINK: Final = 0.95
HANDS: Final = ((0.83, 0.9), (0.5, 1.1), (0.8, 1.05), (0.2, 1.05))
HELD_SIZE: Final = 0.86

# motion.js and board.js
TOWARDS: Final = ((0, -1), (0, 1), (1, 0), (-1, 0))
BUMP_MS: Final = 190
BUMP_TILES: Final = 0.13
BOB_TILES: Final = 0.055
EFFECT_MS: Final = 1400
