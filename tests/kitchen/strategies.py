"""Random kitchens for property tests: layouts, states on them, joint actions."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from galley.kitchen import ChefView, KitchenView, Layout, Rules, from_view
from tests.kitchen.pots import pot_of

INNER = " " * 6 + "XPOTDS"
BORDER = "XXPOTDS"
ONIONS_ONLY = str.maketrans("T", "O")


@st.composite
def rules(draw: Any, tomatoes: bool = True) -> Rules:
    kinds = ["onion", "tomato"] if tomatoes else ["onion"]
    orders = st.none() | st.lists(st.sampled_from(kinds), min_size=1, max_size=3).map(tuple)
    return Rules(
        cook_time_ticks=draw(st.integers(1, 6) | st.just(20)),
        delivery_reward=draw(st.integers(0, 30)),
        horizon_ticks=draw(st.integers(1, 60)),
        orders=draw(orders),
    )


@st.composite
def layouts(draw: Any, tomatoes: bool = True) -> Layout:
    """Closed kitchens from 4x3 to 8x6 with any tiles anywhere, several pots among them."""
    width, height = draw(st.integers(4, 8)), draw(st.integers(3, 6))
    inner = draw(st.lists(st.sampled_from(INNER), min_size=width * height, max_size=width * height))
    border = draw(st.lists(st.sampled_from(BORDER), min_size=width * height, max_size=width * height))
    grid = [
        [
            border[y * width + x] if x in (0, width - 1) or y in (0, height - 1) else inner[y * width + x]
            for x in range(width)
        ]
        for y in range(height)
    ]
    inside = [(x, y) for y in range(1, height - 1) for x in range(1, width - 1)]
    starts = draw(st.permutations(inside))[:2]
    for chef, (x, y) in zip("12", starts, strict=True):
        grid[y][x] = chef
    text = "\n".join("".join(row) for row in grid)
    text = text if tomatoes else text.translate(ONIONS_ONLY)
    return Layout("random", tuple(text.split("\n")), draw(rules(tomatoes)))


@st.composite
def states(draw: Any, layout: Layout) -> NDArray[np.int16]:
    """Any state that can stand on this layout, held things, half-full and cooking pots included."""
    tomatoes = bool(layout.tomatoes)
    kinds = [1, 2] if tomatoes else [1]
    things = st.sampled_from([0, 1, 2, 3, 4, 5] if tomatoes else [0, 1, 3, 4])
    cells = draw(st.permutations(layout.floor))[:2]
    chefs = tuple(ChefView(x, y, draw(st.integers(0, 3)), draw(things)) for x, y in cells)
    pots = {}
    for place in layout.pots:
        count = draw(st.integers(0, 3))
        ticks = draw(st.integers(1, layout.rules.cook_time_ticks)) if count == 3 else 0
        pots[place] = pot_of(draw(st.sampled_from(kinds)) if count else 0, count, ticks)
    lying = {place: draw(st.sampled_from([0, 0, 0]) | things) for place in layout.counters}
    seen = KitchenView(
        (chefs[0], chefs[1]),
        {place: thing for place, thing in lying.items() if thing},
        pots,
        tick=draw(st.integers(0, layout.rules.horizon_ticks)),
        orders_delivered=draw(st.integers(0, len(layout.rules.orders or ()))),
    )
    return from_view(layout, seen)


@st.composite
def situations(draw: Any, tomatoes: bool = True) -> tuple[Layout, NDArray[np.int16]]:
    """A layout and a state on it."""
    layout = draw(layouts(tomatoes))
    return layout, draw(states(layout))


def joint_actions(ticks: int = 25) -> st.SearchStrategy[NDArray[np.uint8]]:
    """uint8[T,2] of up to `ticks` ticks, with many interactions in it."""
    action = st.sampled_from([0, 1, 2, 3, 4, 5, 5, 5])
    pairs = st.lists(st.tuples(action, action), min_size=1, max_size=ticks)
    return pairs.map(lambda listed: np.array(listed, dtype=np.uint8))
