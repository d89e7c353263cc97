"""The kitchen as rebuilt from frames is the kitchen that sent them."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from galley.agents.protocol import Agent
from galley.agents.scripted import Random
from galley.kitchen import Kitchen, Layout
from galley.kitchen.codes import DELIVERIES
from galley.planning.myopic import Myopic
from galley.protocol.keyframes import RoundView
from galley.protocol.keyframes import keyframe as whole_kitchen
from galley.protocol.scene import Scene, event_rows
from galley.simulate.seen import KEY_OF, Seen

RING = Layout.from_ascii("ring", "XXPXX\nO1 2O\nX   X\nXDXSX", cook_time_ticks=5, horizon_ticks=300)


def keyframe(kitchen: Kitchen, seat: int) -> dict[str, Any]:
    view = RoundView(150, 1, 1, False, None, 1, seat, ("blue", "orange"))
    scene, tick = Scene(kitchen.layout), kitchen.tick
    return dict(whole_kitchen(scene, view, kitchen.state, phase="playing", tick=tick, episode=1))


@pytest.mark.parametrize("orders", [None, ("onion", "onion", "onion")])
def test_every_state_is_rebuilt(orders: tuple[str, ...] | None) -> None:
    layout = RING.with_rules(orders=orders)
    kitchen, scene = Kitchen(layout), Scene(layout)
    made: list[str] = []

    def make(where: Layout) -> Agent:
        made.append(where.name)
        return Myopic(epsilon=0.1)

    seen = Seen(keyframe(kitchen, 0), make, {"ring": RING}, seed=1)
    partner = Random()
    partner.reset(layout, 1, 7)
    actions = {key: action for action, key in KEY_OF.items()}
    while not kitchen.done:
        key = seen.decide()
        before = kitchen.state.copy()
        kitchen.step(4 if key is None else actions[key], partner.act(before, kitchen.tick))
        frame = {
            "tick": kitchen.tick,
            **scene.changes(before, kitchen.state),
            "events": event_rows(kitchen.events),
        }
        seen.see(json.loads(json.dumps(frame)))
        expected = kitchen.state.copy()
        expected[DELIVERIES] = 0  # the score is shown, and no agent needs it
        assert np.array_equal(seen.state(), expected)
    assert made == ["ring"], "the layout is known by its map"
    assert kitchen.score > 0, "soups were served"


def test_an_unknown_map_is_drawn_from_the_frame() -> None:
    seen = Seen(keyframe(Kitchen(RING), 1), lambda layout: Random(), {}, seed=1)
    assert seen.layout.grid == RING.grid
    assert seen.layout.rules == RING.rules
    assert seen.chef[:2] == (3, 1)
