"""What a pot holds and a soup is made of: the one place that reads and makes packed pots; compiled."""

from __future__ import annotations

from numpy import int16
from numpy.typing import NDArray

from galley.compiled.kernels import lean_kernel
from galley.kitchen.codes import (
    INGREDIENTS_PER_SOUP,
    ONE_ONION,
    ONE_TOMATO,
    ONION,
    ONION_SOUP,
    POT_COUNT,
    POT_TICKS,
    SPEC_COOK_TIMES,
    TOMATO,
)


@lean_kernel
def recipe_of(onions: int, tomatoes: int) -> int:
    """The number of a recipe of so many onions and tomatoes, together at most 3; 0 for none."""
    if onions + tomatoes == 0:
        return 0
    if tomatoes == 0:
        mix = ONION
    elif onions == 0:
        mix = TOMATO
    elif tomatoes == 1:
        mix = ONE_TOMATO
    else:
        mix = ONE_ONION
    return mix + POT_COUNT * (onions + tomatoes)


@lean_kernel
def recipe_in(pot: int) -> int:
    """The number of the recipe that a packed pot holds, were it cooked now."""
    return pot % POT_TICKS


@lean_kernel
def amount_in(pot: int) -> int:
    """How many ingredients are in a packed pot or a recipe."""
    return pot // POT_COUNT % POT_COUNT


@lean_kernel
def onions_in(pot: int) -> int:
    """How many of them are onions."""
    mix = pot % POT_COUNT
    amount = pot // POT_COUNT % POT_COUNT
    if mix == ONION:
        return amount
    if mix == TOMATO:
        return 0
    return amount - 1 if mix == ONE_TOMATO else min(amount, 1)


@lean_kernel
def is_all(pot: int, ingredient: int) -> bool:
    """Whether all that is in a packed pot or a recipe is one ingredient, and there is some."""
    return pot % POT_COUNT == ingredient


@lean_kernel
def ticks_in(pot: int) -> int:
    """How many ticks a packed pot has cooked."""
    return pot // POT_TICKS


@lean_kernel
def is_soup(pot: int) -> bool:
    """Whether a packed pot cooks or is ready, so that nothing more goes in."""
    return pot // POT_TICKS > 0 or pot // POT_COUNT % POT_COUNT == INGREDIENTS_PER_SOUP


@lean_kernel
def ticks_left(spec: NDArray[int16], pot: int) -> int:
    """How many ticks a packed pot that is a soup still cooks, 0 when it is ready."""
    return int(spec[SPEC_COOK_TIMES + pot % POT_TICKS]) - pot // POT_TICKS


@lean_kernel
def recipe_all(ingredient: int, amount: int) -> int:
    """The number of a recipe of so many, at least 1, of one ingredient."""
    return ingredient + POT_COUNT * amount


@lean_kernel
def whole_soup(ingredient: int) -> int:
    """The number of the recipe of a full soup of one ingredient."""
    return ingredient + POT_COUNT * INGREDIENTS_PER_SOUP


@lean_kernel
def thing_of(recipe: int) -> int:
    """The soup, as a thing, of a recipe. Under `classic` there are two."""
    return ONION_SOUP + recipe - whole_soup(ONION)


@lean_kernel
def soup_of(ingredient: int) -> int:
    """The full soup, as a thing, of one ingredient."""
    return thing_of(whole_soup(ingredient))


@lean_kernel
def recipe_of_thing(soup: int) -> int:
    """The recipe of a soup that is held or lies about."""
    return soup - ONION_SOUP + whole_soup(ONION)
