"""The myopic human: which subtask it takes, how it gets there, and that it gets soups served."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from galley.kitchen import (
    EAST,
    INTERACT,
    NORTH,
    SOUTH,
    STAY,
    WEST,
    ChefView,
    Kitchen,
    KitchenView,
    Layout,
    PotView,
    from_view,
)
from galley.planning.distances import distances
from galley.planning.kernels.myopic_kernel import target
from galley.planning.kernels.needs_kernel import NOWHERE
from galley.planning.myopic import Myopic
from tests.kitchen.pots import pot_of
from tests.planning.layouts import FORCED, MIXED, ROOM, layouts

ONION, TOMATO, DISH, ONION_SOUP, TOMATO_SOUP = 1, 2, 3, 4, 5


def state(
    layout: Layout,
    held: tuple[int, int] = (0, 0),
    pots: dict[tuple[int, int], PotView] | None = None,
    things: dict[tuple[int, int], int] | None = None,
    delivered: int = 0,
) -> NDArray[np.int16]:
    """A state with the chefs where they start, facing north."""
    first, second = (ChefView(*start, 0, thing) for start, thing in zip(layout.starts, held, strict=True))
    filled = {place: pot_of() for place in layout.pots} | (pots or {})
    return from_view(layout, KitchenView((first, second), things or {}, filled, orders_delivered=delivered))


def goal(layout: Layout, now: NDArray[np.int16], seat: int = 0) -> tuple[int, int] | None:
    """Where the subtask is."""
    found = distances(layout)
    cell = target(layout.spec, found.costs, found.reachable, now, seat)
    return None if cell == NOWHERE else layout.place(cell)


COOKS = pot_of(ONION, 3, 5)
POT = (2, 0)


@pytest.mark.parametrize(
    ("held", "pot", "things", "where"),
    [
        ((0, 0), pot_of(), {}, (0, 1)),  # an onion is missing: the near dispenser
        ((0, 0), pot_of(), {(0, 2): ONION}, (0, 2)),  # one lies nearer
        ((0, 0), COOKS, {}, (1, 3)),  # a soup cooks: a dish
        ((0, DISH), COOKS, {}, None),  # the other has one already
        ((0, 0), COOKS, {(0, 2): ONION_SOUP}, (0, 2)),  # a soup lies about
        ((ONION, 0), pot_of(ONION, 2), {}, POT),
        ((ONION, 0), COOKS, {}, (1, 0)),  # no pot takes it: on the nearest counter
        ((TOMATO, 0), pot_of(ONION, 1), {}, (1, 0)),
        ((DISH, 0), COOKS, {}, POT),
        ((DISH, 0), pot_of(ONION, 2), {(1, 0): DISH}, (0, 2)),
        ((ONION_SOUP, 0), pot_of(), {}, (3, 3)),
    ],
)
def test_subtasks(
    held: tuple[int, int], pot: PotView, things: dict[tuple[int, int], int], where: tuple[int, int] | None
) -> None:
    assert goal(ROOM, state(ROOM, held, {POT: pot}, things)) == where


def test_orders_decide_what_is_cooked_and_served() -> None:
    layout = MIXED.with_rules(orders=("tomato", "onion"))
    onions, tomatoes = (0, 1), (7, 1)
    assert goal(layout, state(layout)) == tomatoes
    first = {(2, 0): pot_of(TOMATO, 1)}
    assert goal(layout, state(layout, pots=first)) in (onions, tomatoes)  # one to fill up, one to begin
    cooking = {(2, 0): pot_of(TOMATO, 3, 3)}
    assert goal(layout, state(layout, (0, DISH), cooking)) == onions
    assert goal(layout, state(layout, (ONION, 0), cooking)) == (5, 0)
    assert goal(layout, state(layout, (TOMATO, 0), cooking)) not in layout.pots
    assert goal(layout, state(layout, (TOMATO_SOUP, 0))) == (7, 3)
    early = goal(layout, state(layout, (ONION_SOUP, 0)))
    assert early in layout.counters  # put down until its order comes
    assert goal(layout, state(layout, (0, 0), things={(3, 2): ONION_SOUP})) != (3, 2)
    assert goal(layout, state(layout, (0, 0), things={(3, 2): ONION_SOUP}, delivered=1)) == (3, 2)


def test_without_orders_a_started_pot_is_filled_with_its_kind() -> None:
    pots = {(2, 0): pot_of(TOMATO, 2), (5, 0): pot_of(ONION, 3, 20)}
    assert goal(MIXED, state(MIXED, (0, DISH), pots)) == (7, 1)


def test_things_are_passed_where_chefs_stand_apart() -> None:
    left = 1
    shared = {(2, 1), (2, 2), (2, 3)}
    assert goal(FORCED, state(FORCED), left) in FORCED.onions
    assert goal(FORCED, state(FORCED, (0, ONION)), left) in shared
    assert goal(FORCED, state(FORCED, things={(2, 3): ONION}), 0) == (2, 3)
    full = {place: pot_of(ONION, 3, 20) for place in FORCED.pots}
    assert goal(FORCED, state(FORCED, pots=full), left) == (0, 3)
    assert goal(FORCED, state(FORCED, (0, DISH), full), left) in shared
    enough = {(2, 1): DISH, (2, 2): DISH}
    assert goal(FORCED, state(FORCED, pots=full, things=enough), left) is None
    assert goal(FORCED, state(FORCED, (0, ONION), full), left) not in shared
    assert goal(FORCED, state(FORCED, (ONION_SOUP, 0)), 0) == (3, 4)


def test_the_receiver_makes_room_on_full_shared_counters() -> None:
    full = {place: pot_of(ONION, 3, 20) for place in FORCED.pots}
    things = {(2, 1): ONION, (2, 2): ONION, (2, 3): ONION}
    assert goal(FORCED, state(FORCED, pots=full, things=things), 0) in things
    assert goal(FORCED, state(FORCED, (ONION, 0), full, {(2, 2): ONION, (2, 3): ONION}), 0) not in things


def acting(layout: Layout, now: NDArray[np.int16], seat: int = 0) -> tuple[Myopic, int]:
    agent = Myopic()
    agent.reset(layout, seat, seed=3)
    return agent, agent.act(now, 0)


def test_it_waits_beside_a_cooking_pot_and_takes_the_soup_when_ready() -> None:
    chefs = (ChefView(2, 1, NORTH, DISH), ChefView(3, 2, NORTH))
    for ticks, action in ((19, STAY), (20, INTERACT)):
        now = from_view(ROOM, KitchenView(chefs, {}, {POT: pot_of(ONION, 3, ticks)}))
        assert acting(ROOM, now)[1] == action


def test_a_blocked_chef_moves_at_random_to_a_free_cell() -> None:
    chefs = (ChefView(2, 1, WEST), ChefView(1, 1, NORTH))  # the way to the onions leads through the other
    now = from_view(ROOM, KitchenView(chefs, {}, {POT: pot_of()}))
    moves = set()
    for seed in range(30):
        agent = Myopic()
        agent.reset(ROOM, 0, seed)
        assert agent.act(now, 0) == WEST
        agent.observe(now, (WEST, STAY))
        moves.add(agent.act(now, 1))
    assert moves == {SOUTH, EAST}


def test_a_chef_who_waits_where_the_other_wants_to_go_gives_way() -> None:
    chefs = (ChefView(2, 1, NORTH, DISH), ChefView(3, 1, WEST))
    now = from_view(ROOM, KitchenView(chefs, {}, {POT: COOKS}))
    agent, action = acting(ROOM, now)
    assert action == STAY
    agent.observe(now, (STAY, STAY))
    assert agent.act(now, 1) == STAY
    agent.observe(now, (STAY, WEST))
    assert agent.act(now, 2) in (SOUTH, WEST)


def scores(layout: Layout, epsilon: float = 0.0, games: int = 4) -> list[int]:
    found = []
    for seed in range(games):
        kitchen = Kitchen(layout)
        pair = (Myopic(epsilon), Myopic(epsilon))
        for seat, agent in enumerate(pair):
            agent.reset(layout, seat, seed)
        while not kitchen.done:
            now = kitchen.state.copy()
            joint = (pair[0].act(now, kitchen.tick), pair[1].act(now, kitchen.tick))
            kitchen.step(*joint)
            for agent in pair:
                agent.observe(now, joint)
        found.append(kitchen.score)
    return found


@pytest.mark.parametrize(
    ("drawing", "least"),
    [
        ("XXPXX\nO  2O\nX1  X\nXDXSX", 160),
        ("XXXPX\nX 1 P\nD2X X\nO   X\nXOSXX", 100),  # a ring: only one can pass
        ("XXXPX\nO X1P\nO2X X\nD X X\nXXXSX", 200),  # nothing without passing
        ("XXXPX\nT X1P\nT2X X\nD X X\nXXXSX", 200),  # the same with tomatoes
        ("XXXPPXXX\nX  2   X\nD XXXX S\nX  1   X\nXXXOOXXX", 80),
        ("XXXXX\nP1S2O\nD X X\nXXXXX", 20),  # only one can cook, with what the other passes
    ],
)
def test_pairs_score(drawing: str, least: int) -> None:
    assert min(scores(Layout.from_ascii("kitchen", drawing))) >= least


def test_pairs_serve_every_order() -> None:
    layout = MIXED.with_rules(orders=("tomato", "onion", "onion", "tomato"))
    assert scores(layout) == [80] * 4


def test_noise_changes_what_it_does() -> None:
    assert np.mean(scores(ROOM, 0.9)) < np.mean(scores(ROOM)) - 60


@given(layouts(), st.integers(0, 2**32))
def test_any_kitchen_can_be_played(layout: Layout, seed: int) -> None:
    kitchen = Kitchen(layout)
    pair = (Myopic(0.2), Myopic())
    for seat, agent in enumerate(pair):
        agent.reset(layout, seat, seed)
    while not kitchen.done:
        now = kitchen.state.copy()
        joint = (pair[0].act(now, kitchen.tick), pair[1].act(now, kitchen.tick))
        assert all(0 <= action <= 5 for action in joint)
        kitchen.step(*joint)
        for agent in pair:
            agent.observe(now, joint)
