"""Kitchens as the field's package writes them, and back.

Source: `OvercookedState.to_dict` of the `overcooked-ai` 1.1.0 package, in the rows that the `overcooked-demo`
server of Carroll et al. writes and `human_aware_rl` reads.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.kitchen.codes import INGREDIENTS_PER_SOUP, ONION_SOUP, POT, THINGS, TOMATO_SOUP
from galley.kitchen.layout import Place
from galley.kitchen.pots import amount_in, onions_in, recipe_of_thing
from galley.kitchen.state import ChefView, KitchenView, PotView

ACTIONS_THERE: Final = ([0, -1], [0, 1], [1, 0], [-1, 0], [0, 0], "interact")
"""Our action codes as the field writes them; the first four are facings too."""


def state_there(layout: Layout, seen: KitchenView) -> dict[str, Any]:
    """A kitchen as the field's package writes it."""
    cook_time = layout.rules.cook_time_ticks
    things = [_thing(code, place, cook_time) for place, code in seen.things.items()]
    soups = [_pot(pot, place, cook_time) for place, pot in seen.pots.items() if pot.count]
    return {
        "players": [_chef(chef, cook_time) for chef in seen.chefs],
        "objects": [*things, *soups],
        "bonus_orders": [],
        "all_orders": [
            {"ingredients": [kind] * INGREDIENTS_PER_SOUP} for kind in _orders(layout, seen.orders_delivered)
        ],
        "timestep": seen.tick,
    }


def _orders(layout: Layout, delivered: int) -> list[str]:
    if layout.rules.orders is not None:
        return sorted(set(layout.rules.orders[delivered:]))
    return ["onion", *(["tomato"] if layout.tomatoes else [])]


def _chef(chef: ChefView, cook_time: int) -> dict[str, Any]:
    held = _thing(chef.held, (chef.x, chef.y), cook_time) if chef.held else None
    return {"position": [chef.x, chef.y], "orientation": ACTIONS_THERE[chef.facing], "held_object": held}


def _thing(code: int, place: tuple[int, int], cook_time: int) -> dict[str, Any]:
    if code in (ONION_SOUP, TOMATO_SOUP):
        recipe = recipe_of_thing(code)
        onions = onions_in(recipe)
        return _soup(onions, amount_in(recipe) - onions, cook_time, place, cook_time)
    return {"name": THINGS[code], "position": list(place)}


def _pot(pot: PotView, place: tuple[int, int], cook_time: int) -> dict[str, Any]:
    full = pot.count == INGREDIENTS_PER_SOUP
    return _soup(pot.onions, pot.tomatoes, pot.ticks if full else -1, place, cook_time)


def _soup(onions: int, tomatoes: int, ticks: int, place: tuple[int, int], cook_time: int) -> dict[str, Any]:
    idle = ticks < 0
    names = ["onion"] * onions + ["tomato"] * tomatoes
    return {
        "name": "soup",
        "position": list(place),
        "_ingredients": [{"name": name, "position": list(place)} for name in names],
        "cooking_tick": ticks,
        "is_cooking": not idle and ticks < cook_time,
        "is_ready": ticks >= cook_time,
        "is_idle": idle,
        "cook_time": -1 if idle else cook_time,
        "_cooking_tick": ticks,
    }


def action_here(told: Any) -> int:
    """The code of an action as the field writes it.

    Raises:
        ValueError: it is none.
    """
    return ACTIONS_THERE.index(told.lower() if isinstance(told, str) else told)


def state_here(layout: Layout, told: Mapping[str, Any]) -> KitchenView:
    """The kitchen that `state_there` writes as `told`.

    Raises:
        GalleyError: it holds what the rules of Galley do not have yet, such as a soup of two kinds.
        KeyError, IndexError, TypeError, ValueError: it is not such a kitchen.
    """
    first, second = (_chef_here(layout, player) for player in told["players"])
    things: dict[Place, int] = {}
    pots: dict[Place, PotView] = {}
    for record in told["objects"]:
        x, y = record["position"]
        if layout.tiles[y, x] == POT:
            onions, tomatoes, ticks = _contents(layout, record)
            pots[x, y] = PotView(onions, tomatoes, ticks)
        else:
            things[x, y] = _thing_here(layout, record)
    return KitchenView((first, second), things, pots, tick=int(told["timestep"]))


def _chef_here(layout: Layout, player: Mapping[str, Any]) -> ChefView:
    x, y = player["position"]
    held = player.get("held_object")
    facing = ACTIONS_THERE.index(player["orientation"])
    return ChefView(int(x), int(y), facing, 0 if held is None else _thing_here(layout, held))


def _thing_here(layout: Layout, record: Mapping[str, Any]) -> int:
    if record["name"] != "soup":
        return THINGS.index(record["name"])
    onions, _, ticks = _contents(layout, record)
    if ticks < layout.rules.cook_time_ticks:
        raise ValueError("an unfinished soup outside a pot")
    return ONION_SOUP if onions else TOMATO_SOUP


def _contents(layout: Layout, record: Mapping[str, Any]) -> tuple[int, int, int]:
    """(onions, tomatoes, cooking ticks) of a soup."""
    names = [one["name"] for one in record["_ingredients"]]
    onions, tomatoes = names.count("onion"), names.count("tomato")
    ticks = max(0, int(record["_cooking_tick"]))
    if onions + tomatoes != len(names):
        raise ValueError(f"a soup of {' '.join(names)}")
    if (onions and tomatoes) or (ticks and len(names) < INGREDIENTS_PER_SOUP):
        raise GalleyError("its soups are mixed or of fewer than three, which rule set classic does not have")
    return onions, tomatoes, min(ticks, layout.rules.cook_time_ticks)
