"""What the replay page gets is what the rules make of the journal, tick for tick."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from galley.kitchen import Kitchen, Layout
from galley.protocol.scene import Scene
from galley.records import RoundRow, SeatRow
from galley.server.researcher.replay_document import replay_document
from tests.records.helpers import TINY, joint_actions, one_soup


def row(actions: list[tuple[int, int]], layout: Layout = TINY, **changes: Any) -> RoundRow:
    values: dict[str, Any] = {
        "id": 1,
        "study": "demo",
        "round_no": 2,
        "layout": layout.name,
        "layout_json": json.dumps(layout.to_dict()),
        "horizon_ticks": layout.rules.horizon_ticks,
        "tick_ms": 50,
        "seed": 1,
        "status": "finished",
        "score": None,
        "deliveries": None,
        "final_sha256": None,
        "created_ms": 0,
        "ended_ms": 1,
        "seats": (
            SeatRow(0, None, None, "chef-a", "a" * 64, "orange"),
            SeatRow(1, 7, "rounds-1", hat="blue"),
        ),
        "joint_actions": np.array(actions, np.uint8).reshape(-1, 2),
    }
    return RoundRow(**values | changes)


def shown_after(document: dict[str, Any], tick: int) -> tuple[Any, Any, Any]:
    """Chefs, things and pots that a page shows after `tick` ticks, put together as the page does."""
    frame = [frame for frame in document["frames"] if frame["at"] < max(1, tick)][-1]
    board = frame["board"]
    chefs = board["chefs"]
    things = {(x, y): thing for x, y, thing in board["things"]}
    pots = {(x, y): rest for x, y, *rest in board["pots"]}
    for step in document["steps"][frame["at"] : tick]:
        chefs = step["chefs"]
        things |= {(x, y): thing for x, y, thing in step["things"]}
        pots |= {(x, y): rest for x, y, *rest in step["pots"]}
    return chefs, {place: thing for place, thing in things.items() if thing}, pots


def test_every_tick_shows_the_kitchen_as_the_rules_have_it() -> None:
    actions = joint_actions(3, 40)
    document = json.loads(json.dumps(replay_document(row(actions), {})))
    kitchen, scene = Kitchen(TINY), Scene(TINY)
    for tick in range(len(actions) + 1):
        whole = json.loads(json.dumps(scene.whole(kitchen.state)))
        chefs, things, pots = shown_after(document, tick)
        assert chefs == whole["chefs"]
        assert things == {(x, y): thing for x, y, thing in whole["things"]}
        assert pots == {(x, y): rest for x, y, *rest in whole["pots"]}
        if tick < len(actions):
            kitchen.step(*actions[tick])
            assert document["steps"][tick]["actions"] == list(actions[tick])


def test_a_partner_is_seen_unless_the_round_was_played_alone() -> None:
    def partner(agent: str, hat: str | None) -> str:
        seats = (SeatRow(0, None, None, agent, "a" * 64, hat), SeatRow(1, 7, "rounds-1", hat="blue"))
        document = replay_document(row([(4, 4)], seats=seats), {})
        return str(document["frames"][0]["board"]["partner"])

    assert partner("stay", None) == "none"
    assert partner("stay", "orange") == partner("chef-a", None) == "agent"


def test_score_and_events_are_there() -> None:
    document = replay_document(row(one_soup()), {})
    assert (document["score"], document["ticks"], document["whole"]) == (20, 40, 40)
    events = [event for step in document["steps"] for event in step["events"]]
    assert [event[0] for event in events if event[0] in ("soup_ready", "delivery")] == [
        "soup_ready",
        "delivery",
    ]
    assert document["frames"][0]["board"]["seat"] == 1
    assert document["frames"][0]["board"]["hats"] == ["orange", "blue"]


def test_episodes_follow_each_other_and_their_scores_add_up() -> None:
    document = replay_document(row(one_soup() + one_soup()[:10], episodes=2), {})
    assert [frame["at"] for frame in document["frames"]] == [0, 40]
    assert document["frames"][1]["board"]["score"] == 20
    assert document["steps"][-1]["score"] == 20
    assert (document["ticks"], document["whole"]) == (50, 80)
    chefs, _, _ = shown_after(document, 45)
    assert chefs == shown_after(document, 5)[0]


def test_an_episode_that_ends_early_hands_over_to_the_next() -> None:
    layout = TINY.with_rules(orders=("onion",))
    soup = one_soup()
    document = replay_document(row(soup + soup[:3], layout, episodes=2), {})
    assert document["frames"][0]["at"] == 0
    second = document["frames"][1]["at"]
    assert 0 < second <= 40
    assert document["ticks"] == len(soup) + 3


def test_only_what_was_played_since_is_sent_again() -> None:
    whole = replay_document(row(one_soup(), status="open"), {})
    for after in (0, 1, 17, 39, 40, 400):
        more = replay_document(row(one_soup(), status="open"), {}, after)
        assert more["from"] == min(after, 40)
        assert more["steps"] == whole["steps"][after:]
        assert more["ticks"] == 40


def test_a_round_without_a_tick_shows_its_start() -> None:
    document = replay_document(row([], status="open"), {})
    assert (document["ticks"], document["steps"], len(document["frames"])) == (0, [], 1)


def test_late_and_unusable_decisions_are_marked() -> None:
    ticks = {
        0: {"late": True, "fault": None},
        1: {"late": False, "fault": "error"},
        2: {"late": False, "fault": None},
    }
    document = replay_document(row(one_soup()[:4]), ticks)
    assert [step["why"] for step in document["steps"]] == ["late", "error", None, None]
