"""Pots of one ingredient, as `classic` has them."""

from __future__ import annotations

from galley.kitchen import PotView
from galley.kitchen.codes import ONION


def pot_of(kind: int = 0, count: int = 0, ticks: int = 0, ready: bool = False) -> PotView:
    """A pot that holds so many of one ingredient, an onion or a tomato by its code."""
    return PotView(count, 0, ticks, ready) if kind == ONION else PotView(0, count, ticks, ready)


def kind_of(pot: PotView) -> int:
    """The code of the ingredient that a pot holds, 0 for none."""
    return 0 if pot.count == 0 else 1 if pot.onions else 2
