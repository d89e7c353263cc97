"""The settings of rounds on a real server: episodes, keys that act once, playing alone, absences."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from galley.records.database.tables import ABSENCES
from galley.records.reading import overview
from galley.records.reading.films import footage_of_round
from galley.records.reading.verify import verify_study
from galley.records.store import queries
from galley.server.researcher.replay_document import replay_document
from tests.records.stored import stored_episodes, stored_trajectory
from tests.server.helpers import Participant, Served, serving
from tests.server.participant.test_flow import row_of
from tests.study.workspaces import study_workspace

ROUNDS = """
format: 1
title: Rounds of all kinds
seed: 4
tick_ms: 20
horizon_ticks: 20
countdown_s: 0
abandon_after_s: 2
completion: {code: R-1}
stages:
  - {kind: consent, text: consent}
  - {kind: tutorial, layout: practice_alone, agent: none, seat: 0}
  - kind: rounds
    agents: [random]
    layouts: [{layout: cramped_room, goal: 20, bonus: 0.5}]
    episodes: 3
    input_mode: press
    show_score: never
  - {kind: debrief, text: debrief}
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("rounds")
    with serving(study_workspace(folder / "lab", ROUNDS), folder / "records.sqlite") as up:
        yield up


def at_the_rounds(served: Served) -> Participant:
    person = Participant(served)
    person.agree()
    with person.play() as player:
        assert player.whole_round()["outcome"] == "finished"
        assert player.received[0]["partner"] == "none"
    person.load()
    assert row_of(person).step_index == 2
    return person


def test_nobody_is_seen_in_the_replay_or_the_film_of_a_round_played_alone(served: Served) -> None:
    visit = row_of(at_the_rounds(served))
    practice = served.store.open_round(visit.id, "tutorial").result()
    with_agent = served.store.open_round(visit.id, "rounds-1").result()
    assert practice is not None
    assert with_agent is None, "it begins with its first connection"
    assert [seat.kind for seat in stored_trajectory(served.store, practice.id).seats] == ["human", "nobody"]
    assert footage_of_round(served.store, practice.id).drawn == (0,)
    board = replay_document(practice, {})["frames"][0]["board"]
    assert (board["seat"], board["partner"]) == (0, "none")
    with served.store.reading() as connection:
        (shown,) = overview.rounds(connection, "mine", visit_id=visit.id)
    assert (shown.agents, len(shown.participants)) == ((), 1)


def test_episodes_are_one_round_in_the_records_and_replay(served: Served) -> None:
    person = at_the_rounds(served)
    assert "3 games" in person.page.text
    with person.play() as player:
        ended = player.whole_round()
        frame = player.received[0]
    assert (frame["episodes"], frame["input_mode"], frame["show_score"]) == (3, "press", "never")
    assert ended["outcome"] == "finished"
    ticks = [message["tick"] for message in player.received if message["type"] == "tick"]
    assert ticks == list(range(1, 21)) * 3
    row = served.store.open_round(row_of(person).id, "rounds-1").result()
    assert row is not None
    assert (row.status, row.episodes, len(row.joint_actions), row.score) == (
        "finished",
        3,
        60,
        ended["score"],
    )
    assert len(stored_episodes(served.store, row.id)) == 3
    report = verify_study(served.store, "mine")
    assert report.ok, str(report)


def test_coming_back_in_the_second_episode_goes_on_there(served: Served) -> None:
    person = at_the_rounds(served)
    with person.play() as player:
        player.hello()
        player.send("ready")
        player.until("keyframe", episode=2, phase="playing")
        player.until("tick", tick=5)
    with person.play() as player:
        frame = player.hello()
        assert (frame["phase"], frame["episode"]) == ("paused", 2)
        assert frame["tick"] >= 5
        player.send("ready")
        assert player.until("ended")["outcome"] == "finished"
    row = served.store.open_round(row_of(person).id, "rounds-1").result()
    assert row is not None
    assert len(row.joint_actions) == 60
    assert verify_study(served.store, "mine").ok


def test_leaving_for_good_in_the_second_episode_replays_too(served: Served) -> None:
    person = at_the_rounds(served)
    with person.play() as player:
        player.hello()
        player.send("ready")
        player.until("keyframe", episode=2, phase="countdown")
    with person.play() as player:
        player.hello()
        assert player.until("ended")["outcome"] == "abandoned"
    report = verify_study(served.store, "mine")
    assert report.ok, str(report)


def test_a_page_out_of_sight_is_an_absence_in_the_records(served: Served) -> None:
    person = at_the_rounds(served)
    with person.play() as player:
        player.hello()
        player.send("ready")
        player.until("tick")
        player.send("release", reason="hidden", seq=next(player.seq), client_ms=1.0)
        player.until("tick", tick=10)
        player.send("release", reason="shown", seq=next(player.seq), client_ms=2.0)
        player.until("ended")
    with served.store.reading() as connection:
        mine = ABSENCES.select().where(ABSENCES.c.visit_id == row_of(person).id)
        (absence,) = connection.execute(mine).all()
        assert queries.rounds_of_visit(connection, row_of(person).id)
    assert absence.step_id == "rounds-1"
    assert 50 < absence.ended_ms - absence.started_ms < 20_000
