"""Verifying stored rounds: what is right passes, every kind of damage is found."""

from __future__ import annotations

import pytest
from sqlalchemy import text

from galley.errors import GalleyError
from galley.kitchen import Kitchen
from galley.records import Store, TickRow
from galley.records.reading.round_replay import state_bytes
from galley.records.reading.verify import verify_study
from tests.records.helpers import (
    START_MS,
    TINY,
    begin,
    joint_actions,
    one_soup,
    open_round,
    play,
    tick_rows,
)


def test_rounds_as_they_were_played_agree(store: Store) -> None:
    visit = begin(store)
    play(store, open_round(store, visit, "tutorial"), joint_actions(1, 7), "skipped")
    play(store, open_round(store, visit, "rounds-1"), one_soup())
    play(store, open_round(store, visit, "rounds-2"), joint_actions(2, 13), "abandoned")
    store.journal(open_round(store, begin(store)), tick_rows(joint_actions(3, 5)))
    open_round(store, begin(store))
    store.flush().result()
    report = verify_study(store, "demo")
    assert report.ok
    assert str(report) == "rounds=5 ticks=65 open=2 matched=5 mismatched=0"


def test_a_round_whose_orders_are_all_served_may_end_early(store: Store) -> None:
    layout = TINY.with_rules(orders=("onion",), horizon_ticks=60)
    round_id = open_round(store, begin(store), layout=layout)
    kitchen = Kitchen(layout)
    for a0, a1 in one_soup():
        kitchen.step(a0, a1)
    assert kitchen.done
    store.journal(round_id, tick_rows(one_soup()))
    store.finish_round(round_id, "finished", 20, 1, START_MS, state_bytes(kitchen.state)).result()
    assert verify_study(store, "demo").ok


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (
            "UPDATE ticks SET action_0 = 1 WHERE tick = 0",
            ["score: stored 20, replayed 0", "hash", "deliveries"],
        ),
        ("UPDATE ticks SET action_1 = 3 WHERE tick = 39", ["hash of the last state"]),
        ("UPDATE ticks SET action_1 = 9 WHERE tick = 3", ["actions must be codes"]),
        ("DELETE FROM ticks WHERE tick = 20", ["tick 20 is missing", "after 39 of 40 ticks"]),
        ("DELETE FROM ticks WHERE tick = 39", ["after 39 of 40 ticks"]),
        ("DELETE FROM ticks", ["after 0 of 40 ticks"]),
        (
            "INSERT INTO ticks SELECT round_id, 40, 4, 4, 0, 0, 0, false, NULL FROM ticks WHERE tick = 0",
            ["41 ticks are stored, yet the episode is over after 40"],
        ),
        ("UPDATE rounds SET score = 40", ["score: stored 40, replayed 20"]),
        ("UPDATE rounds SET deliveries = NULL", ["deliveries: stored None, replayed 1"]),
        ("UPDATE rounds SET final_sha256 = 'x'", ["hash of the last state: stored x, replayed"]),
        ("UPDATE rounds SET layout_json = '{'", ["round 1"]),
        ("UPDATE rounds SET layout_json = '{}'", ["not a layout"]),
        ("UPDATE ticks SET late = true WHERE tick = 2", ["tick 2: the agent of seat 0 was late or at fault"]),
    ],
)
def test_damage_is_found(store: Store, damage: str, told: list[str]) -> None:
    play(store, open_round(store, begin(store)), one_soup())
    assert verify_study(store, "demo").ok
    with store._engine.begin() as connection:
        assert connection.execute(text(damage)).rowcount > 0
    report = verify_study(store, "demo")
    assert not report.ok
    lines = str(report).splitlines()
    assert lines[-1].endswith("matched=0 mismatched=1")
    assert all(line.startswith("round 1 (tiny, finished): ") for line in lines[:-1])
    for words in told:
        assert words in str(report)


def test_a_late_agent_that_stood_still_is_right(store: Store) -> None:
    round_id = open_round(store, begin(store))
    store.journal(round_id, [TickRow(0, 4, 2, START_MS, 1.0, None, True)])
    store.flush().result()
    assert verify_study(store, "demo").ok


def test_an_unknown_study_is_told(store: Store) -> None:
    with pytest.raises(GalleyError, match="no visit of study 'nowhere'"):
        verify_study(store, "nowhere")
