"""Each rule of the kitchen on a small drawn kitchen."""

from __future__ import annotations

import numpy as np
import pytest

from galley.kitchen import (
    EAST,
    INTERACT,
    NORTH,
    SOUTH,
    STAY,
    THINGS,
    WEST,
    ChefView,
    Kitchen,
    KitchenBatch,
    KitchenView,
    Layout,
    PotView,
    from_view,
)
from tests.kitchen.pots import pot_of

ROOM = Layout.from_ascii(
    "room",
    """
    XPTXX
    O1 2S
    X   X
    XDXXX
    """,
    cook_time_ticks=3,
    horizon_ticks=50,
)
ONION, TOMATO, DISH, ONION_SOUP, TOMATO_SOUP = range(1, 6)
POT = (1, 0)


def kitchen(
    first: ChefView, second: ChefView, layout: Layout = ROOM, things=None, pots=None, **rest: int
) -> Kitchen:
    made = Kitchen(layout)
    made.state[:] = from_view(layout, KitchenView((first, second), things or {}, pots or {}, **rest))
    return made


def away() -> ChefView:
    return ChefView(3, 2, SOUTH)


def test_chefs_start_facing_north_with_empty_hands() -> None:
    start = Kitchen(ROOM).view
    assert start.chefs == (ChefView(1, 1, NORTH, 0), ChefView(3, 1, NORTH, 0))
    assert (start.tick, start.score, dict(start.things)) == (0, 0, {})
    assert start.pots == {POT: pot_of()}


@pytest.mark.parametrize(
    ("action", "place"), [(NORTH, (2, 1)), (SOUTH, (2, 3)), (EAST, (3, 2)), (WEST, (1, 2))]
)
def test_a_move_turns_and_goes_one_cell(action: int, place: tuple[int, int]) -> None:
    hall = Layout.from_ascii("hall", "XXXXX\nX   X\nX 1 X\nX   X\nX2  X\nXXXXX")
    made = Kitchen(hall)
    made.step(action, STAY)
    assert made.view.chefs[0] == ChefView(*place, action)


def test_a_move_against_a_tile_only_turns() -> None:
    made = Kitchen(ROOM)
    made.step(WEST, EAST)
    assert made.view.chefs == (ChefView(1, 1, WEST), ChefView(3, 1, EAST))


def test_staying_and_interacting_change_no_facing() -> None:
    made = kitchen(ChefView(2, 2, EAST), ChefView(3, 1, WEST))
    made.step(STAY, INTERACT)
    assert made.view.chefs == (ChefView(2, 2, EAST), ChefView(3, 1, WEST))


def test_two_chefs_who_want_one_cell_both_stay_and_turn() -> None:
    made = kitchen(ChefView(1, 1, NORTH), ChefView(3, 1, NORTH))
    made.step(EAST, WEST)
    assert made.view.chefs == (ChefView(1, 1, EAST), ChefView(3, 1, WEST))


def test_chefs_do_not_swap_cells() -> None:
    made = kitchen(ChefView(1, 1, NORTH), ChefView(2, 1, NORTH))
    made.step(EAST, WEST)
    assert made.view.chefs == (ChefView(1, 1, EAST), ChefView(2, 1, WEST))


def test_nobody_walks_into_a_chef_who_stays() -> None:
    made = kitchen(ChefView(1, 1, NORTH), ChefView(2, 1, NORTH))
    made.step(EAST, STAY)
    assert made.view.chefs[0] == ChefView(1, 1, EAST)


def test_a_chef_follows_into_the_cell_that_the_other_leaves() -> None:
    made = kitchen(ChefView(1, 1, NORTH), ChefView(2, 1, NORTH))
    made.step(EAST, EAST)
    assert made.view.chefs == (ChefView(2, 1, EAST), ChefView(3, 1, EAST))


@pytest.mark.parametrize(
    ("chef", "thing"),
    [(ChefView(1, 1, WEST), ONION), (ChefView(2, 1, NORTH), TOMATO), (ChefView(1, 2, SOUTH), DISH)],
)
def test_dispensers_give_one_thing_to_empty_hands(chef: ChefView, thing: int) -> None:
    made = kitchen(chef, away())
    made.step(INTERACT, STAY)
    assert made.view.chefs[0].held == thing
    made.step(INTERACT, STAY)
    assert made.view.chefs[0].held == thing


@pytest.mark.parametrize("thing", range(1, len(THINGS)))
def test_counters_keep_and_give_back_any_thing(thing: int) -> None:
    made = kitchen(ChefView(1, 2, WEST, thing), away())
    made.step(INTERACT, STAY)
    assert made.view.chefs[0].held == 0
    assert made.view.things == {(0, 2): thing}
    made.step(INTERACT, STAY)
    assert made.view.chefs[0].held == thing
    assert made.view.things == {}


def test_a_full_counter_takes_nothing() -> None:
    made = kitchen(ChefView(1, 2, WEST, ONION), away(), things={(0, 2): DISH})
    made.step(INTERACT, STAY)
    assert (made.view.chefs[0].held, made.view.things) == (ONION, {(0, 2): DISH})


@pytest.mark.parametrize("kind", [ONION, TOMATO])
def test_three_of_a_kind_cook_by_themselves_and_the_filling_tick_counts(kind: int) -> None:
    made = kitchen(ChefView(1, 1, NORTH, kind), away(), pots={POT: pot_of(kind, 2)})
    made.step(INTERACT, STAY)
    assert made.view.pots[POT] == pot_of(kind, 3, 1)
    made.step(STAY, STAY)
    assert made.view.pots[POT] == pot_of(kind, 3, 2)
    made.step(STAY, STAY)
    assert made.view.pots[POT] == pot_of(kind, 3, 3, ready=True)
    made.step(STAY, STAY)
    assert made.view.pots[POT] == pot_of(kind, 3, 3, ready=True)


def test_two_in_a_pot_do_not_cook() -> None:
    made = kitchen(ChefView(1, 1, NORTH, ONION), away(), pots={POT: pot_of(ONION, 1)})
    made.step(INTERACT, STAY)
    made.step(STAY, STAY)
    assert made.view.pots[POT] == pot_of(ONION, 2, 0)


@pytest.mark.parametrize("pot", [pot_of(ONION, 1), pot_of(ONION, 3, 2), pot_of(TOMATO, 3, 3)])
def test_a_pot_takes_neither_another_kind_nor_a_fourth(pot: PotView) -> None:
    made = kitchen(ChefView(1, 1, NORTH, TOMATO), away(), pots={POT: pot})
    made.step(INTERACT, STAY)
    assert made.view.chefs[0].held == TOMATO
    assert made.view.pots[POT].count == pot.count


@pytest.mark.parametrize(("kind", "soup"), [(ONION, ONION_SOUP), (TOMATO, TOMATO_SOUP)])
def test_a_dish_takes_a_ready_soup(kind: int, soup: int) -> None:
    made = kitchen(ChefView(1, 1, NORTH, DISH), away(), pots={POT: pot_of(kind, 3, 3)})
    made.step(INTERACT, STAY)
    assert made.view.chefs[0].held == soup
    assert made.view.pots[POT] == pot_of()


@pytest.mark.parametrize("pot", [pot_of(), pot_of(ONION, 2), pot_of(ONION, 3, 2)])
def test_a_dish_takes_nothing_that_is_not_ready(pot: PotView) -> None:
    made = kitchen(ChefView(1, 1, NORTH, DISH), away(), pots={POT: pot})
    made.step(INTERACT, STAY)
    assert made.view.chefs[0].held == DISH


@pytest.mark.parametrize("held", [0, ONION, TOMATO_SOUP])
def test_only_a_dish_takes_a_soup_from_a_pot(held: int) -> None:
    made = kitchen(ChefView(1, 1, NORTH, held), away(), pots={POT: pot_of(ONION, 3, 3)})
    made.step(INTERACT, STAY)
    assert made.view.chefs[0].held == held


@pytest.mark.parametrize("soup", [ONION_SOUP, TOMATO_SOUP])
def test_any_soup_pays_without_an_order_list(soup: int) -> None:
    made = kitchen(ChefView(3, 1, EAST, soup), ChefView(1, 1, NORTH))
    assert made.step(INTERACT, STAY) == 20
    assert (made.score, made.view.chefs[0].held) == (20, 0)


@pytest.mark.parametrize("thing", [0, ONION, TOMATO, DISH])
def test_the_serving_place_takes_soups_only(thing: int) -> None:
    made = kitchen(ChefView(3, 1, EAST, thing), ChefView(1, 1, NORTH))
    assert made.step(INTERACT, STAY) == 0
    assert made.view.chefs[0].held == thing


def test_a_soup_out_of_order_pays_nothing_and_is_gone() -> None:
    ordered = ROOM.with_rules(orders=("tomato", "onion"))
    made = kitchen(ChefView(3, 1, EAST, ONION_SOUP), ChefView(1, 1, NORTH), ordered)
    assert made.step(INTERACT, STAY) == 0
    assert (made.view.chefs[0].held, made.view.orders_delivered, made.done) == (0, 0, False)


def test_the_episode_ends_with_the_last_order() -> None:
    ordered = ROOM.with_rules(orders=("tomato", "onion"), delivery_reward=7)
    made = kitchen(ChefView(3, 1, EAST, TOMATO_SOUP), ChefView(1, 1, NORTH), ordered)
    assert made.step(INTERACT, STAY) == 7
    assert not made.done
    made.state[2] = ONION_SOUP
    assert made.step(INTERACT, STAY) == 7
    assert made.done
    assert made.step(EAST, EAST) == 0
    assert (made.tick, made.score) == (2, 14)


def test_no_interaction_follows_the_last_delivery_within_its_tick() -> None:
    """As recorded in the LSI user study: who takes a dish as the other serves the last order gets none."""
    ordered = ROOM.with_rules(orders=("onion",))
    made = kitchen(ChefView(3, 1, EAST, ONION_SOUP), ChefView(1, 1, WEST), ordered)
    made.step(INTERACT, INTERACT)
    assert made.done
    assert made.view.chefs[1].held == 0
    later = kitchen(ChefView(1, 1, WEST), ChefView(3, 1, EAST, ONION_SOUP), ordered)
    later.step(INTERACT, INTERACT)
    assert later.done
    assert later.view.chefs[0].held == ONION


def test_seat_0_interacts_before_seat_1() -> None:
    counter = Layout.from_ascii("pass", "XXXXX\nX1X2X\nXXXXX")
    both = kitchen(ChefView(1, 1, EAST, ONION), ChefView(3, 1, WEST), counter)
    both.step(INTERACT, INTERACT)
    assert [chef.held for chef in both.view.chefs] == [0, ONION]
    other = kitchen(ChefView(1, 1, EAST), ChefView(3, 1, WEST, ONION), counter)
    other.step(INTERACT, INTERACT)
    assert [chef.held for chef in other.view.chefs] == [0, 0]
    assert other.view.things == {(2, 1): ONION}


def test_interaction_acts_on_the_tile_faced_before_moving() -> None:
    made = kitchen(ChefView(1, 1, WEST), ChefView(2, 1, NORTH))
    made.step(INTERACT, SOUTH)
    assert [chef.held for chef in made.view.chefs] == [ONION, 0]


def test_the_horizon_ends_the_episode() -> None:
    made = Kitchen(ROOM.with_rules(horizon_ticks=2))
    made.step(SOUTH, STAY)
    assert not made.done
    made.step(STAY, STAY)
    assert made.done
    last = made.state.copy()
    assert made.step(NORTH, NORTH) == 0
    np.testing.assert_array_equal(made.state, last)
    made.reset()
    assert (made.tick, made.done) == (0, False)


@pytest.mark.parametrize("actions", [(6, 0), (0, -1), (255, 4)])
def test_actions_that_are_no_codes_are_refused(actions: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="codes from 0 to 5"):
        Kitchen(ROOM).step(*actions)
    with pytest.raises(ValueError, match="codes from 0 to 5"):
        KitchenBatch(ROOM, 1).step(np.array([actions]))


def test_batches_refuse_actions_of_another_shape() -> None:
    with pytest.raises(ValueError, match=r"\(3, 2\), not \(2, 2\)"):
        KitchenBatch(ROOM, 3).step(np.zeros((2, 2), dtype=np.uint8))


def test_a_batch_resets_the_kitchens_of_a_mask() -> None:
    batch = KitchenBatch(ROOM, 3)
    batch.step(np.full((3, 2), SOUTH))
    batch.reset(np.array([True, False, True]))
    assert batch.ticks.tolist() == [0, 1, 0]


@pytest.mark.parametrize(
    ("chef", "pots", "things", "other", "expected"),
    [
        (ChefView(1, 1, NORTH, ONION), {}, {}, away(), 3),
        (ChefView(1, 1, NORTH, DISH), {POT: pot_of(ONION, 3, 3)}, {}, away(), 5),
        (ChefView(1, 2, SOUTH), {POT: pot_of(ONION, 1)}, {}, away(), 3),
        (ChefView(1, 2, SOUTH), {POT: pot_of(ONION, 3, 2)}, {}, away(), 3),
        (ChefView(1, 2, SOUTH), {}, {}, away(), 0),
        (ChefView(1, 2, SOUTH), {POT: pot_of(ONION, 1)}, {(0, 2): DISH}, away(), 0),
        (ChefView(1, 2, SOUTH), {POT: pot_of(ONION, 1)}, {(0, 2): ONION}, away(), 3),
        (ChefView(1, 2, SOUTH), {POT: pot_of(ONION, 1)}, {}, ChefView(3, 2, SOUTH, DISH), 0),
        (ChefView(1, 1, WEST), {POT: pot_of(ONION, 1)}, {}, away(), 0),
    ],
)
def test_shaping_rewards_steps_towards_a_soup(chef, pots, things, other, expected: float) -> None:
    batch = KitchenBatch(ROOM, 1)
    batch.states[0] = from_view(ROOM, KitchenView((chef, other), things, pots))
    batch.step(np.array([[INTERACT, STAY]]))
    assert batch.shaping().tolist() == [[expected, 0]]


def test_a_pot_emptied_in_this_tick_still_makes_a_dish_useful() -> None:
    """As in the 2019 code, which looks at the pots once, before anyone interacts."""
    batch = KitchenBatch(ROOM, 1)
    chefs = (ChefView(1, 1, NORTH, DISH), ChefView(1, 2, SOUTH))
    batch.states[0] = from_view(ROOM, KitchenView(chefs, {}, {POT: pot_of(ONION, 3, 3)}))
    batch.step(np.array([[INTERACT, INTERACT]]))
    assert batch.shaping().tolist() == [[5, 3]]
