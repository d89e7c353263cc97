"""The time of a visit runs out: on an open page, in a round, in the lobby, or when nobody is there."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from tests.server.helpers import Participant, Served, serving, wait_until
from tests.server.participant.test_flow import earlier, row_of
from tests.study.workspaces import study_workspace

TIMED = """
format: 1
title: One minute
seed: 4
tick_ms: 20
horizon_ticks: 150
countdown_s: 0
abandon_after_s: 60
visit_limit_min: 1
quota: 1
completion: {code: DONE-1}
endings:
  timed_out: {code: LATE-1}
stages:
  - {kind: consent, text: consent}
  - {kind: rounds, agents: [random], layouts: [{layout: cramped_room}], after_each: after-round}
  - {kind: debrief, text: debrief}
"""
PAIR = TIMED.replace("agents: [random]", "agents: [human]").replace("quota: 1\n", "")
LATER_S = 70
"""Past the limit and what forms on their way are given."""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("timed")
    workspace = study_workspace(folder / "lab", TIMED.replace("quota: 1\n", ""))
    (workspace.path / "studies" / "small.yaml").write_text(TIMED, encoding="utf-8")
    (workspace.path / "studies" / "pair.yaml").write_text(PAIR, encoding="utf-8")
    with serving(workspace, folder / "records.sqlite") as up:
        yield up


def over(person: Participant) -> bool:
    return row_of(person).status == "timed_out"


def told(person: Participant) -> None:
    """The page says that the time is up and gives the code for that."""
    person.load()
    assert person.stage == "ending"
    assert "LATE-1" in person.page.text
    assert "time for this study has run out" in person.page.text


def test_a_visit_that_nobody_looks_at_ends_and_its_slot_returns(served: Served) -> None:
    person = Participant(served, "small")
    late = served.client().post("/s/small/begin")
    assert "try again later" in late.text
    earlier(served, person.token, LATER_S)
    wait_until(lambda: over(person))
    heir = Participant(served, "small")
    assert heir.stage == "consent"
    assert row_of(heir).slot == row_of(person).slot
    told(person)
    assert person.submit({"choice": "agree"}, step="consent").status_code == 200
    assert over(person)


def test_a_round_in_play_is_played_to_its_end_and_then_the_visit_ends(served: Served) -> None:
    person = Participant(served)
    person.agree()
    with person.play() as player:
        player.hello()
        player.send("ready")
        player.until("tick", tick=5)
        earlier(served, person.token, LATER_S)
        ended = player.until("ended")
        ticks = [message["tick"] for message in player.received if message["type"] == "tick"]
    assert ended["outcome"] == "finished"
    assert ticks == list(range(1, 151))
    wait_until(lambda: over(person))
    told(person)


def test_a_round_that_waits_ends_at_once(served: Served) -> None:
    person = Participant(served)
    person.agree()
    with person.play() as player:
        player.hello()
        earlier(served, person.token, LATER_S)
        assert player.until("ended")["outcome"] == "abandoned"
    wait_until(lambda: over(person))
    told(person)


def test_the_other_of_two_is_told_and_goes_on(served: Served) -> None:
    first, second = (Participant(served, "pair") for _ in range(2))
    first.agree()
    second.agree()
    first.load()
    with first.play("a") as one, second.play("b") as two:
        one.hello()
        two.hello()
        earlier(served, first.token, LATER_S)
        assert two.until("ended")["outcome"] == "partner_left"
        assert one.until("ended")["outcome"] == "abandoned"
    wait_until(lambda: over(first))
    told(first)
    second.load()
    assert (second.stage, row_of(second).status) == ("questionnaire", "active")


def test_who_waits_in_the_lobby_is_not_waited_for_any_more(served: Served) -> None:
    first = Participant(served, "pair")
    first.agree()
    assert first.stage == "lobby"
    earlier(served, first.token, LATER_S)
    wait_until(lambda: not first.http.get(f"{first.path}/lobby").json()["waiting"])
    told(first)


def test_an_open_page_counts_down_and_a_form_on_its_way_still_counts(served: Served) -> None:
    person = Participant(served)
    assert re.search(r'class="limit" data-left="\d+" data-from="300"', person.page.text)
    assert "You have about 1 minute left for the study" in person.page.text
    earlier(served, person.token, 61)
    assert person.http.post(person.path, data={"step": "consent", "choice": "agree"}).status_code == 200
    assert row_of(person).consent_sha256 is not None
    told(person)


def test_a_form_that_is_sent_because_the_time_is_up_ends_the_visit_though_it_is_not_complete(
    served: Served,
) -> None:
    person = Participant(served)
    person.agree()
    with person.play() as player:
        player.whole_round()
    person.load()
    assert person.stage == "questionnaire"
    earlier(served, person.token, 61)
    person.submit({"time_up": "1"})
    assert person.stage == "ending"
    assert over(person)
