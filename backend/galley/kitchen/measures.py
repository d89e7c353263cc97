"""How well and how together two chefs cooked.

Source: Fontaine et al. (LSI paper), Sec. V and the user study for workload, concurrent motion and stuck
ticks; App. C for the performance function.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from galley.kitchen.codes import (
    BIT_BLOCKED,
    BIT_DELIVER,
    BIT_PAID,
    BIT_TAKE,
    CELL,
    CHEF,
    FACING,
    OUT_EVENTS,
    STAY,
    TICK,
)
from galley.kitchen.state import score_of
from galley.kitchen.trajectory import Replay, Trajectory, play

_INGREDIENTS = 3 << BIT_TAKE
_DISH = 4 << BIT_TAKE
_SERVED = 3 << BIT_DELIVER
_PAID = 1 << BIT_PAID
_POSES = [CELL, FACING, CHEF + CELL, CHEF + FACING]


@dataclass(frozen=True)
class Measures:
    """The measures of one episode; pairs are seat 0, seat 1."""

    ticks: int
    """Ticks played until the episode ended."""
    score: int
    delivery_ticks: tuple[int, ...]
    """For each soup that paid, the ticks played when it was delivered."""
    ingredients: tuple[int, int]
    """Ingredients taken from dispensers."""
    dishes: tuple[int, int]
    """Dishes taken from dispensers."""
    served: tuple[int, int]
    """Soups delivered."""
    blocked: tuple[int, int]
    """Moves that left the chef in its cell."""
    concurrent_ticks: int
    """Ticks in which neither action was stay; interacting counts as acting."""
    concurrent_share: float
    """The same as a share of all ticks played; 0 without any."""
    stuck_ticks: int
    """Ticks before which both chefs stood and faced as they did the tick before."""
    performance: float | None
    """`performance` of the order list; None without one."""


def measures(trajectory: Trajectory) -> Measures:
    """The measures of a recorded episode; joint actions after its end do not count."""
    return measures_of(play(trajectory.layout, trajectory.joint_actions, trajectory.initial), trajectory)


def measures_of(episode: Replay, trajectory: Trajectory) -> Measures:
    """The measures of an episode that was replayed already."""
    rules = trajectory.layout.rules
    clock = episode.states[:, TICK]
    ticks = int(clock[-1] - clock[0])  # the clock stands still once the episode is over
    masks = episode.out[:ticks, OUT_EVENTS : OUT_EVENTS + 2]
    actions = trajectory.joint_actions[:ticks]
    poses = episode.states[:ticks][:, _POSES]
    paid = (masks & _PAID != 0).sum(axis=1)
    delivered = np.repeat(clock[1 : ticks + 1], paid).tolist()
    concurrent = int((actions != STAY).all(axis=1).sum())

    return Measures(
        ticks=ticks,
        score=int(score_of(trajectory.layout, episode.states[-1])),
        delivery_ticks=tuple(delivered),
        ingredients=_each(masks & _INGREDIENTS != 0),
        dishes=_each(masks & _DISH != 0),
        served=_each(masks & _SERVED != 0),
        blocked=_each(masks >> BIT_BLOCKED & 1 != 0),
        concurrent_ticks=concurrent,
        concurrent_share=concurrent / ticks if ticks else 0.0,
        stuck_ticks=int((poses[1:] == poses[:-1]).all(axis=1).sum()),
        performance=None
        if rules.orders is None
        else performance(delivered, rules.horizon_ticks, len(rules.orders)),
    )


def performance(delivery_ticks: Sequence[int], horizon_ticks: int, orders: int) -> float:
    """How well an order list was served, from 0 to 1: `ranking` over its largest value."""
    largest = (orders + 1) * horizon_ticks**orders - 1  # at most horizon - 1 ticks are left after an order
    return float(ranking(delivery_ticks, horizon_ticks, orders) / largest)


def ranking(delivery_ticks: Sequence[int], horizon_ticks: int, orders: int) -> int:
    """The performance before division: how many orders were served, then ticks left, as digits of one number.

    The base is the horizon. The number of orders is the first digit, then come the ticks left after the last
    order, down to those after the first: orders served at ticks 20 and 60 of 100 give 24,080.
    `delivery_ticks` are the ticks played when each order was served.

    Source: LSI paper, App. C, for any horizon and number of orders.
    """
    left = [horizon_ticks - tick for tick in delivery_ticks]
    digits = sum(horizon_ticks**place * ticks for place, ticks in enumerate(left))
    return int(len(left) * horizon_ticks**orders + digits)


def _each(happened: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> tuple[int, int]:
    first, second = happened.sum(axis=0).tolist()
    return first, second
