"""Measures of coordination on games made for the purpose, and the performance function at known points."""

from __future__ import annotations

import numpy as np
import pytest

from galley.kitchen import Layout
from galley.kitchen.measures import measures, performance, ranking
from galley.kitchen.trajectory import Trajectory

N, S, E, W, STAY, INTERACT = range(6)
MOVES = {"^": N, "v": S, ">": E, "<": W, ".": STAY, "!": INTERACT}
KITCHEN = Layout.from_ascii(
    "measured",
    """
    XPXXX
    O1 2S
    XDXXX
    """,
    cook_time_ticks=2,
    horizon_ticks=40,
)


def game(first: str, second: str, layout: Layout = KITCHEN) -> Trajectory:
    """A game written as one sign a tick for each seat; the shorter one stays until the end."""
    ticks = max(len(first), len(second))
    rows = [[MOVES[sign] for sign in seat.ljust(ticks, ".")] for seat in (first, second)]
    return Trajectory(layout, np.array(rows, dtype=np.uint8).T)


THREE_ONIONS = "<!^!" * 3
DISH_AND_SOUP = ".v!^!"


def test_workload_belongs_to_the_seat_that_did_the_work() -> None:
    alone = measures(game(THREE_ONIONS + DISH_AND_SOUP, ""))
    assert (alone.ingredients, alone.dishes, alone.served) == ((3, 0), (1, 0), (0, 0))
    mirrored = Layout.from_ascii("mirrored", "XPXXX\nO2 1S\nXDXXX", cook_time_ticks=2, horizon_ticks=40)
    other = measures(game("", THREE_ONIONS + DISH_AND_SOUP, mirrored))
    assert (other.ingredients, other.dishes, other.served) == ((0, 3), (0, 1), (0, 0))


def test_things_from_counters_are_no_workload() -> None:
    passed = measures(game("<!v<!", "", Layout.from_ascii("two", "XPXX\nO1 X\nX 2X\nXDSX", horizon_ticks=40)))
    taken = measures(
        game("<!v<!!!", "", Layout.from_ascii("two", "XPXX\nO1 X\nX 2X\nXDSX", horizon_ticks=40))
    )
    assert passed.ingredients == taken.ingredients == (1, 0)


def test_deliveries_score_and_ticks() -> None:
    alley = Layout.from_ascii("alley", "XPSXXX\nO1 X2X\nXDXXXX", cook_time_ticks=2, horizon_ticks=60)
    measured = measures(game("<!^!<!^!<!^!.v!^!>^!", "", alley))
    assert measured.served == (1, 0)
    assert (measured.score, measured.delivery_ticks) == (20, (20,))
    assert measured.performance is None
    ordered = alley.with_rules(orders=("onion",), horizon_ticks=100)
    measured = measures(game("<!^!<!^!<!^!.v!^!>^!" + "<<<<", "", ordered))
    assert measured.ticks == 20  # the last order ends the game; what comes after does not count
    assert measured.performance == pytest.approx((100 + 80) / 199)
    assert measured.concurrent_ticks == 0


def test_concurrent_motion_counts_every_action_but_stay() -> None:
    measured = measures(game("<!.>.", "!.<>^"))
    assert measured.concurrent_ticks == 2  # ticks 0 and 3
    assert measured.concurrent_share == pytest.approx(2 / 5)


def test_stuck_counts_states_before_an_action_that_equal_the_one_before() -> None:
    # The states before ticks 1 and 3 equal those before 0 and 2; before tick 2 seat 1 has moved.
    assert measures(game("....", ".<..")).stuck_ticks == 2
    assert measures(game("....", "....")).stuck_ticks == 3
    # Interacting leaves cell and facing as they are, so it counts as stuck too.
    assert measures(game("^!!!", "^!!!")).stuck_ticks == 3


def test_blocked_moves() -> None:
    assert measures(game("<<>", "...")).blocked == (2, 0)
    assert measures(game(">>", "<.")).blocked == (1, 1)


def test_a_game_without_ticks() -> None:
    measured = measures(Trajectory(KITCHEN, np.zeros((0, 2), dtype=np.uint8)))
    assert (measured.ticks, measured.concurrent_share, measured.stuck_ticks) == (0, 0.0, 0)


@pytest.mark.parametrize(
    ("ticks", "horizon", "orders", "expected"),
    [
        ((20, 60), 100, 2, 24_080),
        ((), 100, 2, 0),
        ((20,), 100, 2, 10_080),
        ((1, 1), 100, 2, 29_999),
        ((100,), 100, 2, 10_000),
        ((10, 20, 30), 50, 3, 3 * 50**3 + 20 * 50**2 + 30 * 50 + 40),
        ((7,), 150, 1, 150 + 143),
    ],
)
def test_the_performance_function(ticks: tuple[int, ...], horizon: int, orders: int, expected: int) -> None:
    assert ranking(ticks, horizon, orders) == expected
    assert performance(ticks, horizon, orders) == pytest.approx(
        expected / ((orders + 1) * horizon**orders - 1)
    )
    assert 0 <= performance(ticks, horizon, orders) <= 1
