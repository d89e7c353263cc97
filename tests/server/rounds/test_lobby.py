"""Rounds of two people: the lobby that pairs them, two sockets in one round, and who is missing."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.records import RoundRow
from galley.records.database.tables import KEYS
from galley.records.reading.verify import verify_study
from galley.records.store import queries
from galley.records.store.erase import erase_participant
from tests.server.helpers import Participant, Player, Served, serving, together, wait_until
from tests.server.participant.test_flow import earlier, row_of
from tests.study.workspaces import study_workspace

PAIR = """
format: 1
title: Two cooks
seed: 8
tick_ms: 20
horizon_ticks: 30
countdown_s: 0
abandon_after_s: 1
hats: [orange, sky-blue, bluish-green, vermillion]
completion: {code: PAIR-1}
endings:
  partner_missing: {code: ALONE-1}
stages:
  - {kind: consent, text: consent}
  - kind: rounds
    agents: [human]
    layouts: [{layout: cramped_room}]
    lobby: {wait_s: 60, fallback: exit, dropout: end_round}
  - {kind: debrief, text: debrief}
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("pair")
    workspace = study_workspace(folder / "lab", PAIR)
    agents = PAIR.replace("fallback: exit, dropout: end_round", "fallback: myopic, dropout: random")
    (workspace.path / "studies" / "agents.yaml").write_text(agents, encoding="utf-8")
    onward = PAIR.replace("fallback: exit", "fallback: go_on")
    (workspace.path / "studies" / "onward.yaml").write_text(onward, encoding="utf-8")
    with serving(workspace, folder / "records.sqlite") as up:
        yield up


def waiting(served: Served, study: str = "mine") -> Participant:
    """Somebody who waits in the lobby, or is paired with who waited there."""
    person = Participant(served, study)
    person.agree()
    return person


def pair(served: Served, study: str = "mine") -> tuple[Participant, Participant]:
    first = waiting(served, study)
    assert first.stage == "lobby"
    second = waiting(served, study)
    assert second.stage == "round"
    return first, second


def round_of(person: Participant) -> RoundRow:
    row = person.served.store.open_round(row_of(person).id, "rounds-1").result()
    assert row is not None
    return row


def asked(person: Participant) -> dict[str, object]:
    answer: dict[str, object] = person.http.get(f"{person.path}/lobby").json()
    return answer


def test_two_people_are_paired_and_play_one_round_to_its_end(served: Served) -> None:
    first = waiting(served)
    assert first.stage == "lobby"
    assert f'data-poll="{first.path}/lobby"' in first.page.text
    assert asked(first)["waiting"] is True
    third = waiting(served, "onward")
    assert third.stage == "lobby", "another study's people are not mixed in"
    third.submit({"leave": "1"})
    second = waiting(served)
    assert second.stage == "round"
    assert asked(first) == {"waiting": False, "seconds_left": 0}
    first.load()
    assert first.stage == "round"
    one, two = together(first, second)
    assert [played.ended["outcome"] for played in (one, two)] == ["finished", "finished"]
    assert {played.frame["seat"] for played in (one, two)} == {0, 1}
    assert [played.frame["partner"] for played in (one, two)] == ["human", "human"]
    for played in (one, two):
        assert played.frame["hats"][played.frame["seat"]] != played.frame["hats"][1 - played.frame["seat"]]
    assert one.ticks == two.ticks
    for person in (first, second):
        assert person.load().status_code == 200
        assert person.stage == "debrief"
    row = round_of(first)
    assert row.id == round_of(second).id
    assert {seat.visit_id for seat in row.seats} == {row_of(first).id, row_of(second).id}
    assert len(row.joint_actions) == 30
    with served.store.reading() as connection:
        keys = queries.of_round(connection, KEYS, row.id)
    assert {key["seat"] for key in keys} == {0, 1}
    assert set(row.joint_actions[:, 0].tolist()) != {4}
    assert set(row.joint_actions[:, 1].tolist()) != {4}
    report = verify_study(served.store, "mine")
    assert report.ok, str(report)


def test_who_leaves_is_waited_for_and_then_the_other_goes_on(served: Served) -> None:
    first, second = pair(served)
    first.load()
    with first.play("a") as one, second.play("b") as two:
        one.hello()
        two.hello()
        one.send("ready")
        two.send("ready")
        one.until("tick")
        two.socket.close()
        assert one.until("paused")["reason"] == "partner"
        assert one.until("ended")["outcome"] == "partner_left"
    for person in (first, second):
        person.load()
        assert person.stage == "debrief"
    assert round_of(first).status == "abandoned"


def test_an_agent_takes_over_from_who_left_and_the_records_say_so(served: Served) -> None:
    first, second = pair(served, "agents")
    first.load()
    with first.play("a") as one, second.play("b") as two:
        one.hello()
        seat = two.hello()["seat"]
        one.send("ready")
        two.send("ready")
        one.until("tick", tick=5)
        two.socket.close()
        assert one.until("ended")["outcome"] == "finished"
    row = round_of(first)
    assert (row.status, len(row.joint_actions)) == ("finished", 30)
    (stand_in,) = row.stand_ins
    assert (stand_in.seat, stand_in.agent) == (seat, "random")
    assert 5 <= stand_in.tick < 30
    assert second.load().status_code == 200
    assert second.stage == "debrief"


@pytest.mark.parametrize(("study", "stage"), [("mine", "ending"), ("onward", "debrief"), ("agents", "round")])
@pytest.mark.parametrize("leave", [False, True])
def test_when_nobody_comes_the_fallback_follows(served: Served, study: str, stage: str, leave: bool) -> None:
    person = waiting(served, study)
    assert person.stage == "lobby"
    if leave:
        person.submit({"leave": "1"})
    else:
        earlier(served, person.token, 61)
        assert asked(person)["waiting"] is False
        person.load()
    assert person.stage == stage
    if study == "mine":
        assert "ALONE-1" in person.page.text
        assert row_of(person).status == "partner_missing"
    if study == "agents":
        assert 'data-partner="agent"' in person.page.text
        assert "myopic" not in person.page.text
        with person.play() as player:
            assert player.whole_round()["outcome"] == "finished"
        assert round_of(person).partner.agent == "myopic"


def test_d8_whose_partner_left_before_ends_in_a_way_of_its_own(tmp_path: Path) -> None:
    """Who never met anybody ends as partner_missing, with its code; after a round as partner_lost."""
    kitchens = "layouts: [{layout: cramped_room}, {layout: coordination_ring}]"
    two = PAIR.replace("layouts: [{layout: cramped_room}]", kitchens)
    for endings, code in (
        ("  partner_missing: {code: ALONE-1}\n  partner_lost: {code: LOST-1}\n", "LOST-1"),
        ("  partner_missing: {code: ALONE-1}\n", "ALONE-1"),
    ):
        written = two.replace("  partner_missing: {code: ALONE-1}\n", endings)
        lab = study_workspace(tmp_path / code, written)
        with serving(lab, tmp_path / f"{code}.sqlite") as up:
            first, second = waiting(up), waiting(up)
            together(first, second)
            first.load()
            assert first.stage == "lobby"
            first.submit({"leave": "1"})
            assert (first.stage, row_of(first).status) == ("ending", "partner_lost")
            assert code in first.page.text
            alone = waiting(up)  # the second one is not there: its page asks no more
            alone.submit({"leave": "1"})
            assert row_of(alone).status == "partner_missing"


def test_who_stopped_asking_is_not_paired_and_asking_again_brings_them_back(served: Served) -> None:
    first, second = waiting(served), None
    assert first.stage == "lobby"
    first.submit({"leave": "1"})
    second = waiting(served)
    assert second.stage == "lobby", "nobody waits there any more"
    second.load()
    assert second.stage == "lobby", "nobody is paired with themselves"
    second.submit({"leave": "1"})


def test_many_arrive_at_once_and_each_is_paired_once(served: Served) -> None:
    people: list[Participant] = []

    def come() -> None:
        people.append(waiting(served, "onward"))

    with served.store.reading() as connection:
        before = len(queries.rounds_of_study(connection, "onward"))
    threads = [threading.Thread(target=come) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    wait_until(lambda: all(not asked(person)["waiting"] for person in people))
    with served.store.reading() as connection:
        ids = queries.rounds_of_study(connection, "onward")[before:]
        rows = [queries.round_row(connection, number) for number in ids]
    seated = [seat.visit_id for row in rows for seat in row.seats]
    assert sorted(seated) == sorted(row_of(person).id for person in people)


def test_a_round_of_two_goes_on_after_a_restart_once_both_are_back(tmp_path: Path) -> None:
    workspace = study_workspace(tmp_path / "lab", PAIR.replace("abandon_after_s: 1", "abandon_after_s: 60"))
    database = tmp_path / "records.sqlite"
    with serving(workspace, database) as up:
        first, second = pair(up)
        with first.play("a") as one, second.play("b") as two:
            one.hello()
            two.hello()
            one.send("ready")
            two.send("ready")
            one.until("tick", tick=5)
            paths = [first.path, second.path]
    with serving(workspace, database) as up:
        url = up.url.replace("http", "ws")
        with Player(f"{url}{paths[0]}/play", "a") as one, Player(f"{url}{paths[1]}/play", "b") as two:
            assert one.hello()["phase"] == two.hello()["phase"] == "paused"
            one.send("ready")
            assert one.until("paused", reason="partner")
            two.send("ready")
            assert one.until("ended")["outcome"] == two.until("ended")["outcome"] == "finished"
        assert verify_study(up.store, "mine").ok


def test_when_one_is_erased_the_round_is_over_for_the_other(served: Served) -> None:
    first, second = pair(served)
    served.store.end_visit(row_of(first).id, "expired", 0).result()
    erase_participant(served.store, row_of(first).id)
    with second.play() as player:
        player.hello()
        assert player.until("ended")["outcome"] == "abandoned"
    second.load()
    assert second.stage == "debrief"
