"""Kitchens for planners: drawn ones and random ones."""

from __future__ import annotations

from hypothesis import strategies as st

from galley.kitchen import Layout

FORCED = Layout.from_ascii("forced", "XXXPX\nO X1P\nO2X X\nD X X\nXXXSX")
ROOM = Layout.from_ascii("room", "XXPXX\nO  2O\nX1  X\nXDXSX")
MIXED = Layout.from_ascii(
    "mixed",
    """
    XXPXXPXX
    O      T
    X1 XX 2X
    D      S
    XXXXXXXX
    """,
)


@st.composite
def layouts(draw: st.DrawFn, widest: int = 15, highest: int = 10) -> Layout:
    """A closed random kitchen of any size from 4x3, with or without tomatoes and orders, often hopeless."""
    width, height = draw(st.integers(4, widest)), draw(st.integers(3, highest))
    inside = [(x, y) for y in range(1, height - 1) for x in range(1, width - 1)]
    grid = [["X"] * width for _ in range(height)]
    for x, y in inside:
        grid[y][x] = draw(st.sampled_from("    XPOTDS"))
    border = [(x, y) for y in range(height) for x in range(width) if (x, y) not in inside]
    for letter in "PPOTDS":
        x, y = draw(st.sampled_from(border))
        grid[y][x] = letter
    first, second = draw(st.lists(st.sampled_from(inside), min_size=2, max_size=2, unique=True))
    grid[first[1]][first[0]], grid[second[1]][second[0]] = "1", "2"
    kinds = st.sampled_from(["onion", "tomato"])
    orders = draw(st.none() | st.lists(kinds, min_size=1, max_size=4).map(tuple))
    text = tuple("".join(row) for row in grid)
    return Layout("drawn", text).with_rules(horizon_ticks=60, orders=orders)
