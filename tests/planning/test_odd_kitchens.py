"""Kitchens that cannot be served are refused by every planner, naming why; odd ones that can are served."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from galley.agents.protocol import Agent
from galley.errors import GalleyError
from galley.evaluation.teams import Team, evaluate
from galley.kitchen import Kitchen, Layout
from galley.planning.centralized import Centralized
from galley.planning.robots import MDP, QMDP
from galley.planning.team import TeamPlanner

HOPELESS = {
    "no pot": ("XXXXX\nO  2O\nX1  X\nXDXSX", "has no pot"),
    "no dishes": ("XXPXX\nO  2O\nX1  X\nXXXSX", "has no dish dispenser"),
    "no onions": ("XXPXX\nX  2X\nX1  X\nXDXSX", "has no onion dispenser"),
    "serving in a corner": ("XXPXS\nO  2O\nX1  X\nXDXXX", r"reach the serving place at \(4, 0\)"),
    "a walled-in chef": ("XXPXXXX\nO  XX2X\nX1 XXXX\nXDXSXXX", r"reach the serving place at \(3, 3\)"),
    "two walled-in chefs": ("XXPXXXX\nO XXXXX\nX1XX2XX\nXDXXSXX", r"reach the pot at \(2, 0\)"),
    "an island": (
        "XXXXXXX\nO  2  S\nX XXX X\nX XPX X\nX XXX X\nX1    D\nXXXXXXX",
        r"reach the pot at \(3, 3\)",
    ),
    "apart": ("XXPXXXXX\nO  XX  X\nX1 XX 2S\nXDXXXXXX", "stand apart and share no counter"),
    "dishes on the wrong side": ("XXXXXXX\nO  P  X\nD1 P 2S\nXXXXXXX", "stand apart and share no counter"),
}
ODD = {
    "apart with a counter": "XXPXXXX\nO  X  X\nX1 X 2S\nXDXXXXX",
    "apart with a pot between": "XXXXXXX\nO  P  D\nX1 P 2S\nXXXXXXX",
    "one cell each": "XPXXX\nO1X2S\nXDXXX",
    "a narrow corridor": "XXXXXXXXX\nO1     2S\nXXXPXDXXX",
}


@pytest.mark.parametrize("name", HOPELESS)
def test_who_cannot_serve_refuses(name: str) -> None:
    drawn, why = HOPELESS[name]
    layout = Layout.from_ascii(name, drawn)
    agents: tuple[Callable[[], Agent], ...] = (MDP, QMDP, Centralized)
    for make in agents:
        with pytest.raises(GalleyError, match=why):
            make().reset(layout, 0, 0)
    with pytest.raises(GalleyError, match=why):
        TeamPlanner(layout)
    with pytest.raises(GalleyError, match=why):
        evaluate(layout, Team())


@pytest.mark.parametrize("name", ODD)
def test_a_team_serves_where_it_can_be_done(name: str) -> None:
    layout = Layout.from_ascii(name, ODD[name], horizon_ticks=120)
    pair = (Centralized(), Centralized())
    for seat, agent in enumerate(pair):
        agent.reset(layout, seat, 0)
    kitchen = Kitchen(layout)
    while not kitchen.done:
        state, tick = kitchen.state.copy(), kitchen.tick
        joint = (pair[0].act(state, tick), pair[1].act(state, tick))
        kitchen.step(*joint)
        for agent in pair:
            agent.observe(state, joint)
    assert kitchen.score >= 40


def test_a_plan_that_cannot_be_found_is_said_to_be_incomplete() -> None:
    """Two chefs in a row of two cells can never pass each other."""
    layout = Layout.from_ascii("row", "XPXX\nO12S\nXDXX")
    assert not TeamPlanner(layout).plan(Kitchen(layout).state, most_ticks=100).complete
