"""Rounds for two people, of several episodes, and with an agent that stands in."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pytest

from galley.errors import GalleyError
from galley.kitchen import Kitchen
from galley.records import NewRound, SeatRow, Store, VisitRow
from galley.records.reading.round_replay import state_bytes
from galley.records.reading.verify import verify_study
from tests.records.helpers import START_MS, TINY, begin, joint_actions, one_soup, tick_rows
from tests.records.stored import stored_episodes


def shared(first: VisitRow, second: VisitRow, episodes: int = 1) -> NewRound:
    """Round 1 of two visits that play with each other."""
    seats = (
        SeatRow(0, first.id, "rounds-1", hat="blue"),
        SeatRow(1, second.id, "rounds-1", hat="orange"),
    )
    layout = json.dumps(TINY.to_dict())
    return NewRound(1, "tiny", layout, 40, 50, 2**63 + 9, START_MS, seats, episodes)


def finish(store: Store, round_id: int, episodes: Sequence[Sequence[tuple[int, int]]], status: str) -> None:
    """Journal the episodes one after the other and close the round."""
    score = deliveries = tick = 0
    state = b""
    for actions in episodes:
        kitchen = Kitchen(TINY)
        for a0, a1 in actions:
            kitchen.step(a0, a1)
        store.journal(round_id, tick_rows(actions, tick))
        tick += len(actions)
        score += kitchen.score
        deliveries += int(kitchen.view.deliveries)
        state = state_bytes(kitchen.state)
    assert store.finish_round(round_id, status, score, deliveries, START_MS + 9000, state).result()


def test_two_people_share_one_round(store: Store) -> None:
    ada, bob = begin(store), begin(store)
    round_id = store.set_up_round(shared(ada, bob)).result()
    assert store.set_up_round(shared(ada, bob)).result() == round_id
    for visit, seat in ((ada, 0), (bob, 1)):
        row = store.open_round(visit.id, "rounds-1").result()
        assert row is not None
        assert row.id == round_id
        assert [one.visit_id for one in row.seats] == [ada.id, bob.id]
        assert next(one.seat for one in row.seats if one.visit_id == visit.id) == seat
    eve = begin(store)
    with pytest.raises(GalleyError, match="plays another one"):
        store.set_up_round(shared(ada, eve)).result()
    assert store.open_round(eve.id, "rounds-1").result() is None
    finish(store, round_id, [one_soup()], "finished")
    assert verify_study(store, "demo").ok


def test_people_of_different_studies_do_not_meet(store: Store) -> None:
    with pytest.raises(GalleyError, match="same study"):
        store.set_up_round(shared(begin(store), begin(store, "other"))).result()


def test_a_round_of_episodes_starts_afresh_each_time_and_replays(store: Store) -> None:
    ada, bob = begin(store), begin(store)
    round_id = store.set_up_round(shared(ada, bob, 3)).result()
    episodes = [one_soup(), joint_actions(4, 40), one_soup()]
    finish(store, round_id, episodes, "finished")
    report = verify_study(store, "demo")
    assert report.ok, str(report)
    assert report.ticks == 120
    found = stored_episodes(store, round_id)
    assert [one.joint_actions.tolist() for one in found] == [[list(p) for p in one] for one in episodes]
    row = store.open_round(ada.id, "rounds-1").result()
    assert row is not None
    assert (row.episodes, row.score, row.deliveries, row.played_ticks) == (3, 40, 2, 120)


@pytest.mark.parametrize(
    ("lengths", "words"),
    [
        ((40, 40), "after 2 of 3 episodes"),
        ((40, 40, 39), "39 of 40 ticks of episode 3"),
        ((40, 40, 41), "41 ticks of episode 3"),
    ],
)
def test_a_round_with_the_wrong_number_of_ticks_is_found(
    store: Store, lengths: tuple[int, ...], words: str
) -> None:
    round_id = store.set_up_round(shared(begin(store), begin(store), 3)).result()
    finish(store, round_id, [joint_actions(7, length) for length in lengths], "finished")
    report = verify_study(store, "demo")
    assert words in str(report)


def test_an_agent_may_take_the_seat_of_somebody_who_left(store: Store) -> None:
    ada, bob = begin(store), begin(store)
    round_id = store.set_up_round(shared(ada, bob)).result()
    assert store.stand_in(round_id, 1, 12, "myopic", "b" * 64, START_MS + 600).result() is True
    assert store.stand_in(round_id, 1, 20, "stay", "c" * 64, START_MS + 900).result() is False
    row = store.open_round(ada.id, "rounds-1").result()
    assert row is not None
    (other,) = row.stand_ins
    assert (other.seat, other.tick, other.agent) == (1, 12, "myopic")
