"""Every event of the table happens, once, with its seat, thing and place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from numpy.typing import NDArray

from galley.kitchen import EVENTS, ChefView, Event, Kitchen, KitchenView, Layout, PotView, from_view
from galley.kitchen.events import PLACES
from galley.kitchen.trajectory import play
from tests.kitchen.pots import pot_of
from tests.kitchen.strategies import joint_actions, situations

ROOM = Layout.from_ascii("room", "XPTXX\nO1 2S\nX   X\nXDXXX", cook_time_ticks=2, orders=("onion",))
N, S, E, W, STAY, INTERACT = range(6)
AWAY = ChefView(3, 2, S)


@pytest.mark.parametrize(
    ("chef", "action", "pot", "thing", "expected"),
    [
        (ChefView(1, 1, W), INTERACT, pot_of(), 0, ("pick_up", "onion", "dispenser", 0, 1, 0)),
        (ChefView(2, 1, N), INTERACT, pot_of(), 0, ("pick_up", "tomato", "dispenser", 2, 0, 0)),
        (ChefView(1, 2, S), INTERACT, pot_of(), 0, ("pick_up", "dish", "dispenser", 1, 3, 0)),
        (ChefView(1, 2, W), INTERACT, pot_of(), 3, ("pick_up", "dish", "counter", 0, 2, 0)),
        (ChefView(1, 2, W), INTERACT, pot_of(), 5, ("pick_up", "tomato_soup", "counter", 0, 2, 0)),
        (ChefView(1, 1, N, 3), INTERACT, pot_of(1, 3, 2), 0, ("pick_up", "onion_soup", "pot", 1, 0, 0)),
        (ChefView(1, 1, N, 3), INTERACT, pot_of(2, 3, 2), 0, ("pick_up", "tomato_soup", "pot", 1, 0, 0)),
        (ChefView(1, 2, W, 4), INTERACT, pot_of(), 0, ("put_down", "onion_soup", "counter", 0, 2, 0)),
        (ChefView(1, 1, N, 2), INTERACT, pot_of(2, 1), 0, ("potting", "tomato", "pot", 1, 0, 0)),
        (ChefView(3, 1, E, 4), INTERACT, pot_of(), 0, ("delivery", "onion_soup", "serving", 4, 1, 20)),
        (ChefView(3, 1, E, 5), INTERACT, pot_of(), 0, ("delivery", "tomato_soup", "serving", 4, 1, 0)),
        (ChefView(1, 1, E), N, pot_of(), 0, ("blocked", "", "pot", 1, 0, 0)),
        (ChefView(1, 1, E), W, pot_of(), 0, ("blocked", "", "dispenser", 0, 1, 0)),
        (ChefView(3, 1, E), N, pot_of(), 0, ("blocked", "", "counter", 3, 0, 0)),
        (ChefView(3, 1, N), E, pot_of(), 0, ("blocked", "", "serving", 4, 1, 0)),
        (ChefView(2, 2, N), E, pot_of(), 0, ("blocked", "", "floor", 3, 2, 0)),
    ],
)
def test_each_event(chef: ChefView, action: int, pot: PotView, thing: int, expected: tuple) -> None:
    things = {(0, 2): thing} if thing else {}
    for seat in (0, 1):
        chefs = (chef, AWAY) if seat == 0 else (AWAY, chef)
        kitchen = Kitchen(ROOM)
        kitchen.state[:] = from_view(ROOM, KitchenView(chefs, things, {(1, 0): pot}, tick=7))
        kitchen.step(*((action, STAY) if seat == 0 else (STAY, action)))
        kind, name, place, x, y, reward = expected
        assert kitchen.events == (Event(7, seat, kind, name, place, x, y, reward),)


@pytest.mark.parametrize(("kind", "soup"), [(1, "onion_soup"), (2, "tomato_soup")])
def test_soup_ready_has_no_seat(kind: int, soup: str) -> None:
    kitchen = Kitchen(ROOM)
    chefs = (ChefView(1, 1, S), AWAY)
    kitchen.state[:] = from_view(ROOM, KitchenView(chefs, {}, {(1, 0): pot_of(kind, 3, 1)}))
    kitchen.step(STAY, STAY)
    assert kitchen.events == (Event(0, None, "soup_ready", soup, "pot", 1, 0),)
    kitchen.step(STAY, STAY)
    assert kitchen.events == ()


@given(situations(), joint_actions())
def test_events_tell_all_that_changed_in_hands_and_on_counters(
    situation: tuple[Layout, NDArray[np.int16]], actions: NDArray[np.uint8]
) -> None:
    layout, state = situation
    episode = play(layout, actions, state)
    events = episode.events()
    assert {event.kind for event in events} <= set(EVENTS)
    assert {event.place for event in events} <= set(PLACES)
    assert sum(event.reward for event in events) == episode.out[:, 0].sum()
    for tick in range(len(actions)):
        first = int(state[6]) + tick
        for seat in (0, 1):
            before, after = (
                episode.states[tick, 3 * seat : 3 * seat + 3],
                episode.states[tick + 1, 3 * seat :],
            )
            mine = [event for event in events if event.tick == first and event.seat == seat]
            assert len(mine) <= 1
            handled = [event for event in mine if event.kind != "blocked"]
            assert (before[2] != after[2]) == bool(handled)
