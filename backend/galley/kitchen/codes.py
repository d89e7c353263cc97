"""The small numbers that kitchens are made of: actions, facings, tiles, things, places in arrays.

The compiled kernels take these in as constants.
"""

from __future__ import annotations

from typing import Final

# Actions; the first four are also the facings. Source: Carroll et al. 2019, `Action.ALL_ACTIONS`.
NORTH: Final = 0
SOUTH: Final = 1
EAST: Final = 2
WEST: Final = 3
STAY: Final = 4
INTERACT: Final = 5
ACTIONS: Final = ("north", "south", "east", "west", "stay", "interact")
FACINGS: Final = ACTIONS[:4]

# Tiles, in the order of their letters.
FLOOR: Final = 0
COUNTER: Final = 1
POT: Final = 2
ONION_DISPENSER: Final = 3
TOMATO_DISPENSER: Final = 4
DISH_DISPENSER: Final = 5
SERVING: Final = 6
TILE_LETTERS: Final = " XPOTDS"
STATIONS: Final = {
    POT: "pot",
    ONION_DISPENSER: "onion dispenser",
    TOMATO_DISPENSER: "tomato dispenser",
    DISH_DISPENSER: "dish dispenser",
    SERVING: "serving place",
}

# Things that are held or lie on a counter.
NOTHING: Final = 0
ONION: Final = 1
TOMATO: Final = 2
DISH: Final = 3
ONION_SOUP: Final = 4
TOMATO_SOUP: Final = 5
THINGS: Final = ("", "onion", "tomato", "dish", "onion_soup", "tomato_soup")
INGREDIENTS_PER_SOUP: Final = 3

# Rule sets, in the order of their codes.
RULE_SETS: Final = ("classic",)
CLASSIC: Final = 0

# One kitchen is one row of int16.
CELL: Final = 0  # of a chef, at 3 * seat
FACING: Final = 1
HELD: Final = 2
CHEF: Final = 3  # numbers a chef takes
TICK: Final = 6
ORDERS_DELIVERED: Final = 7
DELIVERIES: Final = 8  # those that paid
CELLS: Final = 9  # from here on one number a cell: a thing on a counter, or a packed pot

# A recipe, or what is in a pot before it is one: mix + POT_COUNT * number of ingredients, with the mix ONION
# (all are), TOMATO (all are), ONE_TOMATO (the others are onions) or ONE_ONION (the others are tomatoes); 0 is
# nothing. A packed pot is that + POT_TICKS * cooking ticks. `pots.py` reads them.
ONE_TOMATO: Final = 3
ONE_ONION: Final = 0
POT_COUNT: Final = 4
POT_TICKS: Final = 16

# A layout's `spec`: a header, then tiles [H*W], the cells of the pots, the recipes of the order list.
SPEC_WIDTH: Final = 0
SPEC_HEIGHT: Final = 1
SPEC_RULE_SET: Final = 2
SPEC_HORIZON: Final = 3
SPEC_ORDERS: Final = 4  # how many; 0 means no order list
SPEC_POTS: Final = 5  # how many
SPEC_STARTS: Final = 6  # two cells
SPEC_COOK_TIMES: Final = 8  # of each recipe, by its number
SPEC_PRICES: Final = SPEC_COOK_TIMES + POT_TICKS  # likewise
SPEC_TILES: Final = SPEC_PRICES + POT_TICKS

# What a tick writes out: int32[OUT_SIZE].
OUT_SIZE: Final = 4
OUT_REWARD: Final = 0
OUT_EVENTS: Final = 1  # seat 0, then seat 1: bit masks
OUT_READY: Final = 3  # bit mask over the pots in row-major order

# Bits of a seat's event mask. A group covers consecutive things, in the order of their codes.
BIT_TAKE: Final = 0  # onion, tomato, dish from a dispenser
BIT_PICK_UP: Final = 3  # any of the five things from a counter
BIT_FETCH: Final = 8  # onion soup, tomato soup from a pot
BIT_PUT_DOWN: Final = 10  # any of the five things on a counter
BIT_POT: Final = 15  # onion, tomato into a pot
BIT_DELIVER: Final = 17  # onion soup, tomato soup
BIT_BLOCKED: Final = 19
BIT_PAID: Final = 20  # the delivery of this mask paid
BIT_USEFUL_DISH: Final = 21  # the dish taken in this mask was useful (shaping)
