"""What the page makes of messages, run in Node without a browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest

from galley.film.footage import eased
from galley.kitchen import Kitchen, Layout
from galley.protocol.codec import encode, parse_outgoing
from galley.protocol.keyframes import RoundView, keyframe
from galley.protocol.scene import Scene, event_rows
from tests.frontend.pages import FRONTEND

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="there is no Node here")
RING = Layout.from_ascii("ring", "XXPXX\nO1 2O\nX   X\nXDXSX", cook_time_ticks=5, horizon_ticks=400)
VIEW = RoundView(150, 1, 2, False, 40, 1, 0, ("blue", "orange"))


def node(script: str, given: object = None) -> Any:
    """What a script prints as JSON; it has the modules `board`, `messages`, `still_frame`, and `given`."""
    start = "".join(
        f"import * as {name} from {json.dumps((FRONTEND / f'js/{name}.js').as_uri())};\n"
        for name in ("board", "messages", "still_frame")
    )
    start += "const given = JSON.parse(await new Response(process.stdin).text());\n"
    done = subprocess.run(
        ["node", "--input-type=module", "--eval", start + script],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_board_after_every_tick_is_the_kitchen_as_the_rules_have_it() -> None:
    kitchen, scene, rng = Kitchen(RING), Scene(RING), np.random.default_rng(5)
    frames = [encode(keyframe(scene, VIEW, kitchen.state, phase="playing", tick=0, episode=1))]
    wanted = []
    while not kitchen.done:
        before = kitchen.state.copy()
        kitchen.step(int(rng.integers(6)), int(rng.integers(6)))
        events = event_rows(kitchen.events)
        changes = scene.changes(before, kitchen.state)
        frames.append(encode({"type": "tick", "tick": kitchen.tick, "events": events, **changes}))
        whole = scene.whole(kitchen.state)
        wanted.append(
            {
                "tick": kitchen.tick,
                "chefs": whole["chefs"],
                "things": sorted(whole["things"]),
                "pots": sorted(whole["pots"]),
                "score": whole["score"],
            }
        )
    script = """
        const shown = board.boardFrom(messages.parse(given[0]));
        const all = given.slice(1).map((text, number) => {
          board.applyTick(shown, messages.parse(text), 150 * number);
          return {
            tick: shown.tick, score: shown.score,
            chefs: shown.chefs.map(({ x, y, facing, held }) => [x, y, facing, held]),
            things: [...shown.things].map(([cell, { thing }]) => [...board.cellOf(cell), thing]),
            pots: [...shown.pots].map(([cell, pot]) =>
              [...board.cellOf(cell), pot.onions, pot.tomatoes, pot.ticks, pot.ready]),
          };
        });
        console.log(JSON.stringify(all));
    """
    seen = node(script, frames)
    for one in seen:
        one["things"].sort()
        one["pots"].sort()
    assert len(seen) == 400
    assert seen == wanted


def test_a_move_eases_as_in_films() -> None:
    shares = [number / 20 for number in range(21)]
    assert node("console.log(JSON.stringify(given.map(board.eased)))", shares) == pytest.approx(
        [eased(share) for share in shares]
    )
    script = """
        const chef = { x: 3, y: 1, fromX: 2, fromY: 1, movedAt: 100 };
        console.log(JSON.stringify(given.map((share) => board.seenAt(chef, 100 + 150 * share, 150))));
    """
    assert node(script, shares) == [pytest.approx([2 + eased(share), 1]) for share in shares]


def test_the_keyframe_of_a_picture_is_one_of_the_protocol() -> None:
    script = """
        const chefs = [[1, 1, 2, 1], [3, 1, 1, 4]];
        const pots = [[2, 0, 3, 0, 20, true]];
        console.log(JSON.stringify(still_frame.stillFrame(given, chefs, pots, ["blue", "orange"])));
    """
    frame = node(script, Scene(RING).grid)
    assert parse_outgoing(json.dumps(frame)) == frame
