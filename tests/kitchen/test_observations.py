"""Encodings: `grid` against the field's package, those of 2019 against their description and by hand."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import ENCODINGS, ChefView, Encoder, KitchenView, Layout, from_view, view
from tests.kitchen import reference_2019
from tests.kitchen.pots import kind_of, pot_of
from tests.kitchen.strategies import situations
from tests.overcooked_package import mdp

N, S, E, W = range(4)
NOTHING, ONION, TOMATO, DISH, ONION_SOUP, TOMATO_SOUP = range(6)
FACINGS = [(0, -1), (0, 1), (1, 0), (-1, 0)]
ROOM = Layout.from_ascii("room", "XXPPX\nO1 2S\nX   X\nXDXOX", cook_time_ticks=20)


@pytest.fixture(scope="module")
def package() -> Any:
    return mdp()


def as_package_state(package: Any, layout: Layout, seen: KitchenView) -> Any:
    """Our state as the package's OvercookedState."""

    def soup(place: tuple[int, int], kind: int, count: int, ticks: int) -> Any:
        name = "onion" if kind == ONION else "tomato"
        inside = [package.ObjectState(name, place) for _ in range(count)]
        return package.SoupState(place, inside, ticks if count == 3 else -1, layout.rules.cook_time_ticks)

    def thing(place: tuple[int, int], code: int) -> Any:
        if code >= ONION_SOUP:
            return soup(place, code - 3, 3, layout.rules.cook_time_ticks)
        return package.ObjectState({ONION: "onion", TOMATO: "tomato", DISH: "dish"}[code], place)

    objects = {place: thing(place, code) for place, code in seen.things.items()}
    objects |= {
        place: soup(place, kind_of(pot), pot.count, pot.ticks)
        for place, pot in seen.pots.items()
        if pot.count
    }
    players = []
    for chef in seen.chefs:
        held = thing((chef.x, chef.y), chef.held) if chef.held else None
        players.append(package.PlayerState((chef.x, chef.y), FACINGS[chef.facing], held))
    return package.OvercookedState(players, objects, timestep=seen.tick)


@given(situation=situations())
def test_grid_equals_the_packages_lossless_encoding(
    package: Any, situation: tuple[Layout, NDArray[np.int16]]
) -> None:
    layout, state = situation
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rows = [[" " if tile in "12" else tile for tile in row] for row in layout.grid]
        orders = [{"ingredients": ["onion"] * 3}, {"ingredients": ["tomato"] * 3}]
        world = package.OvercookedGridworld(rows, list(layout.starts), start_all_orders=orders)
        theirs = world.lossless_state_encoding(
            as_package_state(package, layout, view(layout, state)), layout.rules.horizon_ticks
        )
    ours = Encoder(layout, "grid").both(state[None])[0]
    for seat in (0, 1):
        np.testing.assert_array_equal(ours[seat], theirs[seat].transpose(2, 1, 0))


@given(situations(tomatoes=False))
def test_2019_grid_equals_its_description(situation: tuple[Layout, NDArray[np.int16]]) -> None:
    layout, state = situation
    ours = Encoder(layout, "overcooked-2019-grid").both(state[None])[0]
    for seat in (0, 1):
        assert ours[seat].tolist() == reference_2019.grid(layout, view(layout, state), seat)


@given(situations(tomatoes=False))
def test_2019_features_equal_their_description(situation: tuple[Layout, NDArray[np.int16]]) -> None:
    layout, state = situation
    ours = Encoder(layout, "overcooked-2019-features").both(state[None])[0]
    for seat in (0, 1):
        assert ours[seat].tolist() == reference_2019.features(layout, view(layout, state), seat)


def test_grid_by_hand() -> None:
    things = {(0, 2): DISH, (4, 2): ONION_SOUP}
    pots = {(2, 0): pot_of(ONION, 2), (3, 0): pot_of(ONION, 3, 5)}
    seen = KitchenView((ChefView(1, 1, W, ONION), ChefView(3, 2, S)), things, pots, tick=361)
    shown = Encoder(ROOM, "grid").seat(from_view(ROOM, seen)[None], 1)[0]
    marked = {(int(c), int(x), int(y)): int(shown[c, y, x]) for c, y, x in np.argwhere(shown)}
    fixed = {key for key in marked if 10 <= key[0] <= 15 or key[0] == 25}
    assert {key: value for key, value in marked.items() if key not in fixed} == {
        (0, 3, 2): 1,
        (1, 1, 1): 1,
        (3, 3, 2): 1,
        (9, 1, 1): 1,
        (16, 2, 0): 2,
        (18, 3, 0): 3,
        (18, 4, 2): 3,
        (20, 3, 0): 15,
        (21, 4, 2): 1,
        (22, 0, 2): 1,
        (23, 1, 1): 1,
    }
    assert shown[10].sum() == 2
    assert shown[11].sum() == 8
    assert shown[12].sum() == 2
    assert (shown[14].sum(), shown[15].sum(), shown[13].sum()) == (1, 1, 0)
    assert (shown[25] == 1).all()
    assert (
        not Encoder(ROOM, "grid")
        .seat(from_view(ROOM, KitchenView(seen.chefs, tick=360))[None], 1)[0, 25]
        .any()
    )


def test_2019_grid_loses_what_is_not_held_while_one_is_held() -> None:
    things = {(0, 2): DISH, (4, 2): ONION, (0, 0): ONION_SOUP}
    pots = {(2, 0): pot_of(ONION, 2), (3, 0): pot_of(ONION, 3, 5)}

    def channels(held: int) -> dict[int, int]:
        seen = KitchenView((ChefView(1, 1, W, held), ChefView(3, 2, S)), things, pots)
        shown = Encoder(ROOM, "overcooked-2019-grid").seat(from_view(ROOM, seen)[None], 0)[0]
        return {channel: int(shown[:, :, channel].sum()) for channel in range(15, 20)}

    assert channels(NOTHING) == {15: 5, 16: 5, 17: 1, 18: 1, 19: 1}
    assert channels(DISH) == {
        15: 5,
        16: 5,
        17: 1,
        18: 1,
        19: 1,
    }  # the dish at the chef, not that on the counter
    assert channels(ONION_SOUP) == {15: 0, 16: 0, 17: 1, 18: 1, 19: 1}
    seen = KitchenView((ChefView(1, 1, W, DISH), ChefView(3, 2, S)), things, pots)
    shown = Encoder(ROOM, "overcooked-2019-grid").seat(from_view(ROOM, seen)[None], 1)[0]
    assert np.argwhere(shown[:, :, 18]).tolist() == [[1, 1]]


def test_2019_features_by_hand() -> None:
    pots = {(2, 0): pot_of(ONION, 3, 20, True), (3, 0): pot_of(ONION, 3, 5)}
    seen = KitchenView((ChefView(1, 1, W, ONION), ChefView(3, 2, S, DISH)), {}, pots)
    numbers = Encoder(ROOM, "overcooked-2019-features").seat(from_view(ROOM, seen)[None], 1)[0].tolist()
    own = [0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, -2, -1, -2, 0, 0, 0, 0, 1, -1, 0, 1, 1, 0]
    other = [0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, -1, 1, -1, 0, 2, 0, 0, 3, 0, 1, 0, 0, 1]
    assert numbers[:29] == own
    assert numbers[29:58] == other
    assert numbers[58:] == [-2, -1, 1, 1]


def test_the_closest_is_the_one_that_takes_fewest_actions_then_the_first_in_row_major_order() -> None:
    between = Layout.from_ascii("between", "XXPXX\nO1O2X\nXDXSX")
    encoder = Encoder(between, "overcooked-2019-features")

    def onion(facing: int) -> list[float]:
        seen = KitchenView((ChefView(1, 1, facing), ChefView(3, 1, N)))
        return encoder.seat(from_view(between, seen)[None], 0)[0, 7:9].tolist()

    assert onion(W) == [-1, 0]
    assert onion(E) == [1, 0]
    assert onion(N) == [-1, 0]


@pytest.mark.parametrize("name", ENCODINGS)
def test_shapes_seats_and_given_arrays(name: str) -> None:
    encoder = Encoder(ROOM, name)
    shape = {
        "grid": (26, 4, 5),
        "overcooked-2019-grid": (5, 4, 20),
        "overcooked-2019-features": (62,),
    }[name]
    assert encoder.shape == shape
    first = from_view(ROOM, KitchenView((ChefView(1, 1, W, ONION), ChefView(3, 2, S))))
    states = np.stack([first, from_view(ROOM, KitchenView((ChefView(2, 2, N), ChefView(1, 2, E, DISH))))])
    both = encoder.both(states)
    assert (both.shape, both.dtype) == ((2, 2, *shape), encoder.dtype)
    np.testing.assert_array_equal(encoder.seat(states, 1), both[:, 1])
    np.testing.assert_array_equal(encoder.seat(states, np.array([1, 0])), both[[0, 1], [1, 0]])
    out = np.empty_like(both)
    assert encoder.both(states, out) is out
    np.testing.assert_array_equal(out, both)


def test_what_an_encoder_refuses() -> None:
    tomatoes = Layout.from_ascii("tomatoes", "XPTX\nX12X\nXDSX")
    with pytest.raises(GalleyError, match="unknown; use one of grid"):
        Encoder(ROOM, "lossless")
    with pytest.raises(GalleyError, match="cannot show tomatoes"):
        Encoder(tomatoes, "overcooked-2019-grid")
    assert Encoder(tomatoes, "grid").shape == (26, 3, 4)
    encoder = Encoder(ROOM, "grid")
    states = from_view(ROOM, KitchenView((ChefView(1, 1, N), ChefView(2, 1, N))))[None]
    with pytest.raises(ValueError, match=r"int16 \[B, 29\]"):
        encoder.both(states[0])
    with pytest.raises(ValueError, match=r"int16 \[B, 29\], not int64"):
        encoder.both(states.astype(np.int64))
    with pytest.raises(ValueError, match="seats must be 0 or 1"):
        encoder.seat(states, 2)
    with pytest.raises(ValueError, match="out must be contiguous uint8"):
        encoder.both(states, np.empty((1, 2, 26, 4, 5), dtype=np.float32))
