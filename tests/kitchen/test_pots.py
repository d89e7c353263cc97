"""What a pot holds, in one number and back."""

from __future__ import annotations

import pytest

from galley.kitchen import Kitchen, KitchenView, Layout, PotView, from_view, view
from galley.kitchen.codes import CELLS, ONION, ONION_SOUP, POT_TICKS, TOMATO, TOMATO_SOUP
from galley.kitchen.pots import (
    amount_in,
    is_all,
    onions_in,
    recipe_all,
    recipe_in,
    recipe_of,
    recipe_of_thing,
    soup_of,
    ticks_in,
)
from galley.kitchen.state import state_problem

ROOM = Layout.from_ascii("room", "XPOX\nX12X\nXDSX", cook_time_ticks=3, delivery_reward=7)
MIXES = [(onions, amount - onions) for amount in range(1, 4) for onions in range(amount + 1)]


@pytest.mark.parametrize(("onions", "tomatoes"), MIXES)
@pytest.mark.parametrize("ticks", [0, 1, 2000])
def test_a_pot_keeps_its_counts_and_its_ticks(onions: int, tomatoes: int, ticks: int) -> None:
    pot = recipe_of(onions, tomatoes) + POT_TICKS * ticks
    assert 0 < pot < 2**15
    assert (onions_in(pot), amount_in(pot), ticks_in(pot)) == (onions, onions + tomatoes, ticks)
    assert recipe_in(pot) == recipe_of(onions, tomatoes)
    assert is_all(pot, ONION) == (tomatoes == 0)
    assert is_all(pot, TOMATO) == (onions == 0)
    there = from_view(ROOM, KitchenView(Kitchen(ROOM).view.chefs, pots={(1, 0): PotView(onions, tomatoes)}))
    assert view(ROOM, there).pots[1, 0] == PotView(onions, tomatoes)
    problem = state_problem(ROOM, there)
    assert (problem is None) == (0 in (onions, tomatoes)), "classic does not mix"


def test_recipes_are_all_different_and_those_of_one_ingredient_are_as_they_were() -> None:
    assert len({recipe_of(*mix) for mix in MIXES}) == len(MIXES)
    assert recipe_of(0, 0) == 0
    for kind, soup in ((ONION, ONION_SOUP), (TOMATO, TOMATO_SOUP)):
        for count in range(1, 4):  # kind + 4 * count, in states and in hashes of old records
            assert recipe_all(kind, count) == recipe_of(*(count * (kind == one) for one in (ONION, TOMATO)))
            assert recipe_all(kind, count) == kind + 4 * count
        assert soup_of(kind) == soup == kind + 3
        assert recipe_of_thing(soup) == recipe_all(kind, 3)


def test_a_state_is_as_it_was_in_old_records() -> None:
    chefs = Kitchen(ROOM).view.chefs
    cooking = from_view(ROOM, KitchenView(chefs, {(0, 0): ONION_SOUP}, {(1, 0): PotView(3, 0, 2)}, 9, 0, 2))
    assert cooking.tolist() == [5, 0, 0, 6, 0, 0, 9, 0, 2, 4, 1 + 4 * 3 + 16 * 2, *[0] * 10]
    assert view(ROOM, cooking).score == 14
    assert CELLS == 9
