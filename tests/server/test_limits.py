"""What one visit or one address may ask for (A4, A6, A16)."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from galley.protocol import messages
from galley.records.store.arrivals import slots
from galley.server.limits import MOST_KEPT, Pace, Paces, network_of
from galley.server.researcher import login_throttle
from galley.server.researcher.login_throttle import Throttle
from galley.server.rounds.play_socket import MOST_SOCKETS, SOCKETS_AT_ONCE
from galley.study.visit.condition_slots import UNANSWERED_MS, Issue, Slot, allocate
from tests.records.stored import stored_visit
from tests.server.helpers import ONE_ROUND, Participant, Served, serving
from tests.study.workspaces import study_workspace

HOUR_MS = 3_600_000.0


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("limits")
    lab = study_workspace(folder / "lab", ONE_ROUND)
    with serving(lab, folder / "records.sqlite", begins_per_min=6, requests_per_s=50) as up:
        yield up


def begin(served: Served, address: str) -> int:
    answer = httpx.post(f"{served.url}/s/mine/begin", headers={"x-forwarded-for": address})
    return answer.status_code


def test_a16_one_address_begins_so_many_visits_a_minute(served: Served) -> None:
    """6 at once, then 429 with a time to wait; another address is not held up, an IPv6 /64 counts as one."""
    assert [begin(served, "203.0.113.7") for _ in range(7)] == [303] * 6 + [429]
    answer = httpx.post(f"{served.url}/s/mine/begin", headers={"x-forwarded-for": "203.0.113.7"})
    assert 1 <= int(answer.headers["retry-after"]) <= 10
    assert "wait a minute" in answer.text
    assert begin(served, "203.0.113.8") == 303
    assert [begin(served, f"2001:db8:0:1::{n:x}") for n in range(7)] == [303] * 6 + [429]
    assert begin(served, "2001:db8:0:2::1") == 303


def test_a16_requests_of_one_address_wait_their_turn(served: Served) -> None:
    """A flood from one address is spread out, and nobody else waits with it."""
    headers = {"x-forwarded-for": "203.0.113.20"}
    with ThreadPoolExecutor(30) as pool, httpx.Client(limits=httpx.Limits(max_connections=30)) as http:
        began_s = time.monotonic()
        flood = [pool.submit(http.get, f"{served.url}/s/none", headers=headers) for _ in range(105)]
        time.sleep(0.3)
        other_s = time.monotonic()
        assert httpx.get(f"{served.url}/s/none").status_code == 404
        other_s = time.monotonic() - other_s
        assert {one.result().status_code for one in flood} == {404}
        assert time.monotonic() - began_s > 1.5, "5 at once, 50 a second"
    assert other_s < 1.0


def test_a16_a_slot_of_a_visit_that_never_answered_is_free_sooner() -> None:
    """Ten visits that only began hold a quota of ten for a quarter of an hour, not for the hour."""
    idle = [Slot(n, completed=False, ended=False, last_seen_ms=0.0, answered=False) for n in range(10)]
    assert allocate(idle, UNANSWERED_MS - 1, HOUR_MS, 10) != Issue(0, again=True)
    assert allocate(idle, UNANSWERED_MS, HOUR_MS, 10) == Issue(0, again=True)
    assert allocate(idle, 60_000.0, 60_000.0, 10) == Issue(0, again=True), "or what the study says, if sooner"
    busy = [Slot(n, completed=False, ended=False, last_seen_ms=0.0) for n in range(10)]
    assert allocate(busy, HOUR_MS - 1, HOUR_MS, 10) != Issue(0, again=True)
    assert allocate(busy, HOUR_MS, HOUR_MS, 10) == Issue(0, again=True)


def test_a16_the_store_knows_who_answered(served: Served) -> None:
    """A visit has answered once it is beyond its first step."""

    def answered() -> list[bool]:
        found = served.store.read(lambda connection: slots(connection, "mine")).result()
        return [slot.answered for slot in found if slot.visit_id == visit.id]

    person = Participant(served)
    visit = stored_visit(served.store, person.token)
    assert visit is not None
    assert answered() == [False]
    person.agree()
    assert answered() == [True]


def test_a4_a_visit_has_few_sockets(served: Served) -> None:
    """Of many that say nothing the oldest are closed; the one that plays stays; then handshakes get 429."""
    person = Participant(served)
    person.agree()
    url = served.url.replace("http", "ws") + f"{person.path}/play"
    with person.play() as player, ExitStack() as opened:
        player.hello()
        idle = [opened.enter_context(connect(url)) for _ in range(SOCKETS_AT_ONCE - 1)]
        with pytest.raises(InvalidStatus) as refused:
            connect(url)
        assert refused.value.response.status_code == 429
        player.send("ready")
        player.until("tick")
        closed = 0
        for one in idle[: -(MOST_SOCKETS - 1)]:
            with pytest.raises(ConnectionClosed):
                one.recv(timeout=5)
            closed += one.close_code == messages.CLOSE_REPLACED
        assert closed == SOCKETS_AT_ONCE - 1 - (MOST_SOCKETS - 1)
        with pytest.raises(TimeoutError):
            idle[-1].recv(timeout=0.2)


def test_a4_the_sockets_of_a_visit_share_one_pace() -> None:
    """Two of them have no more than one; a sibling: closing and coming back gives no new burst."""
    paces = Paces(10.0)
    for _ in range(20):
        assert paces.of("visit", 0.0).wait_s(0.0) == 0.0
    assert paces.of("visit", 0.0).wait_s(0.0) == pytest.approx(0.1)
    assert paces.of("other", 0.0).wait_s(0.0) == 0.0


def test_a4_a_flood_of_keys_forgets_nobody_who_is_slowed() -> None:
    """Only paces that stand still are forgotten; beyond that, newcomers share one."""
    paces = Paces(1.0, burst=1)
    assert paces.of("slow", 0.0).wait_s(0.0) == 0.0
    for number in range(MOST_KEPT + 10):
        paces.of(f"address {number}", 0.1).wait_s(0.1)
    assert paces.of("slow", 0.2).wait_s(0.2) > 0
    assert paces.of("newcomer", 0.2).wait_s(0.2) > 1.0
    assert paces.of("newcomer", 99.0).wait_s(99.0) == 0.0, "there is room again later"


def test_a_pace_that_refuses_does_not_count() -> None:
    pace = Pace(1.0, 0.0, burst=2)
    assert [pace.wait_s(0.0, 0.0) for _ in range(4)] == [0.0, 0.0, 1.0, 1.0]
    assert pace.wait_s(1.0, 0.0) == 0.0


@pytest.mark.parametrize(
    ("host", "key"),
    [
        ("203.0.113.7", "203.0.113.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2:ffff::1", "2001:db8:1:2::/64"),
        ("::ffff:203.0.113.7", "203.0.113.7"),
        ("fe80::1%eth0", "fe80::/64"),
        ("testclient", ""),
        ("", ""),
    ],
)
def test_a6_what_counts_as_one_address(host: str, key: str) -> None:
    assert network_of(host) == key


def test_a6_a_flood_of_keys_does_not_flush_the_table() -> None:
    """Who is slowed stays slowed while 10,000 others fail; those without room are slowed together."""
    throttle = Throttle()
    for _ in range(10):
        throttle.failed("guesser", 0.0)
    for number in range(login_throttle.MOST_KEPT + 100):
        throttle.failed(f"address {number}", 1.0)
    assert throttle.wait_s("guesser", 1.0) > 10
    assert 0 < throttle.wait_s("one more", 1.0) <= login_throttle.LONGEST_WAIT_OF_A_NAME_S
    assert throttle.wait_s("one more", 40.0) == 0.0
    throttle.failed("one more", login_throttle.FORGET_AFTER_S + 2.0)
    assert throttle.wait_s("one more", login_throttle.FORGET_AFTER_S + 2.0) == 0.0, "room again"
