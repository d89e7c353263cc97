"""Layouts: what is read off a drawing, and drawings that are no kitchens."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from galley.errors import GalleyError
from galley.kitchen import Layout, Rules
from galley.kitchen.layout import grid_problems
from tests.kitchen.strategies import layouts

ROOM = Layout.from_ascii(
    "room",
    """
    XPTXX
    O1 2S
    XDXXX
    """,
    orders=("tomato", "onion"),
)


def test_places_are_x_y_in_row_major_order() -> None:
    assert (ROOM.width, ROOM.height) == (5, 3)
    assert ROOM.starts == ((1, 1), (3, 1))
    assert (ROOM.pots, ROOM.onions, ROOM.tomatoes) == (((1, 0),), ((0, 1),), ((2, 0),))
    assert (ROOM.dishes, ROOM.servings) == (((1, 2),), ((4, 1),))
    assert ROOM.counters == ((0, 0), (3, 0), (4, 0), (0, 2), (2, 2), (3, 2), (4, 2))
    assert ROOM.floor == ((1, 1), (2, 1), (3, 1))
    assert ROOM.tiles.tolist() == [[1, 2, 4, 1, 1], [3, 0, 0, 0, 6], [1, 5, 1, 1, 1]]


def test_a_layout_never_changes() -> None:
    for array in (ROOM.tiles, ROOM.spec):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_equal_by_content() -> None:
    again = Layout("room", ROOM.grid, Rules(orders=("tomato", "onion")))
    assert again == ROOM
    assert hash(again) == hash(ROOM)
    assert ROOM.with_rules(cook_time_ticks=3) != ROOM
    np.testing.assert_array_equal(ROOM.with_rules(cook_time_ticks=20).spec, ROOM.spec)


@given(layouts())
def test_dictionaries_hold_all_of_a_layout(layout: Layout) -> None:
    assert Layout.from_dict(layout.to_dict()) == layout


@pytest.mark.parametrize("key", ["name", "grid", "rules"])
def test_a_dictionary_without_a_key_is_refused(key: str) -> None:
    data = ROOM.to_dict()
    del data[key]
    with pytest.raises(GalleyError, match=key):
        Layout.from_dict(data)


@pytest.mark.parametrize(
    ("rows", "row", "message"),
    [
        ([], None, "empty"),
        (["XXXX", "X12X", "XQXX"], 2, "tile 'Q' is unknown"),
        (["XXXX", "X12X", "XXX"], 2, "the row has 3 tiles, the others 4"),
        (["XXXX", "X 2X", "XXXX"], None, "chef 1 is missing"),
        (["XXXX", "X1 X", "XXXX"], None, "chef 2 is missing"),
        (["XXXX", "X12X", "X1XX", "XXXX"], 2, "chef 1 is there twice"),
        (["X XX", "X12X", "XXXX"], 0, "the border is open"),
        (["XXXX", "X12 ", "XXXX"], 1, "the border is open"),
        (["XXXX", "1 2X", "XXXX"], 1, "the border is open"),
        (["XXXX", "X12X", "XX X"], 2, "the border is open"),
        (["X" * 101, "X12" + "X" * 98, "X" * 101], None, "101 by 3"),
        (["P" * 32, "X12" + "X" * 29, "X" * 32], None, "32 pots are too many"),
    ],
)
def test_what_is_wrong_with_a_drawing(rows: list[str], row: int | None, message: str) -> None:
    found = grid_problems(tuple(rows))
    assert [(problem.row, message in problem.message) for problem in found] == [(row, True)]
    with pytest.raises(GalleyError, match="room"):
        Layout("room", tuple(rows))


def test_all_problems_of_a_drawing_are_told() -> None:
    found = grid_problems(("XQX", "X1", " XX"))
    words = ["'Q'", "2 tiles", "open", "open", "chef 2"]
    assert len(found) == len(words)
    assert all(word in problem.message for word, problem in zip(words, found, strict=True))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("rule_set", "modern"),
        ("cook_time_ticks", 0),
        ("cook_time_ticks", 2001),
        ("cook_time_ticks", 2.5),
        ("delivery_reward", -1),
        ("horizon_ticks", 0),
        ("horizon_ticks", 32_001),
        ("horizon_ticks", True),
        ("orders", ()),
        ("orders", ("onion", "dish")),
    ],
)
def test_rules_out_of_range_are_refused(field: str, value: object) -> None:
    with pytest.raises(GalleyError, match="room"):
        ROOM.with_rules(**{field: value})
