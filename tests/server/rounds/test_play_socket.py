"""The play socket of a real server: reloads, tabs, bad messages, agents at fault, restarts."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from websockets.exceptions import InvalidStatus

from galley.agents.bundle import Bundle
from galley.kitchen import EAST, STAY, Kitchen, Layout
from galley.records import RoundRow, Store
from galley.records.database.tables import CLOCKS, KEYS, PAUSES, TICKS
from galley.records.store import queries
from tests.records.stored import stored_visit
from tests.server.helpers import ONE_ROUND, Participant, Player, Served, serving, wait_until
from tests.serving import served as real_server
from tests.study.workspaces import study_workspace


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("play")
    with serving(study_workspace(folder / "lab", ONE_ROUND), folder / "records.sqlite") as up:
        yield up


@pytest.fixture
def person(served: Served) -> Participant:
    someone = Participant(served)
    someone.agree()
    return someone


def stored(store: Store, token: str) -> RoundRow:
    """The one round of a visit."""
    visit = stored_visit(store, token)
    assert visit is not None
    row = store.open_round(visit.id, "rounds-1").result()
    assert row is not None
    return row


def rows(store: Store, table: Any, round_id: int) -> list[Any]:
    store.flush().result()
    with store.reading() as connection:
        return list(connection.execute(table.select().where(table.c.round_id == round_id)).all())


def test_a_round_has_exactly_its_ticks_with_unbroken_deadlines(served: Served, person: Participant) -> None:
    with person.play() as player:
        player.whole_round()
        assert [m["tick"] for m in player.received if m["type"] == "tick"] == list(range(1, 41))
    row = stored(served.store, person.token)
    ticks = rows(served.store, TICKS, row.id)
    assert [tick.tick for tick in ticks] == list(range(40))
    assert np.allclose(np.diff([tick.deadline_ms for tick in ticks]), 20.0, atol=1e-3)
    assert abs(ticks[0].deadline_ms - time.time() * 1000) < 60_000
    keys = rows(served.store, KEYS, row.id)
    assert keys
    assert all(0 <= key.tick_applied <= 40 for key in keys)


def test_what_the_browser_is_shown_is_what_is_stored(served: Served, person: Participant) -> None:
    with person.play() as player:
        player.whole_round()
    row = stored(served.store, person.token)
    kitchen = Kitchen(Layout.from_dict(json.loads(row.layout_json)))
    shown = [message for message in player.received if message["type"] == "tick"]
    for message, joint in zip(shown, row.joint_actions.tolist(), strict=True):
        kitchen.step(*joint)
        view = kitchen.view
        assert message["chefs"] == [[c.x, c.y, c.facing, c.held] for c in view.chefs]
        assert message["score"] == view.score
        for x, y, thing in message["things"]:
            assert view.things.get((x, y), 0) == thing
        for x, y, onions, tomatoes, ticks, ready in message["pots"]:
            pot = view.pots[x, y]
            assert (pot.onions, pot.tomatoes, pot.ticks, pot.ready) == (onions, tomatoes, ticks, ready)


def test_a_held_key_walks_every_tick_and_stops_after_its_release(served: Served, person: Participant) -> None:
    with person.play() as player:
        seat = player.hello()["seat"]
        player.send("ready")
        player.until("tick", tick=10)
        player.key("right", True)
        player.until("tick", tick=20)
        player.key("right", False)
        player.until("ended")
    row = stored(served.store, person.token)
    own = row.joint_actions[:, seat].tolist()
    first, last = own.index(EAST), len(own) - own[::-1].index(EAST)
    assert set(own[first:last]) == {EAST}
    keys = rows(served.store, KEYS, row.id)
    assert [key.tick_applied for key in keys] == [first, last]


def test_a_reload_in_the_middle_comes_back_to_the_same_round(served: Served, person: Participant) -> None:
    with person.play("first") as player:
        player.hello()
        player.send("ready")
        player.until("tick", tick=12)
    person.load()
    assert person.stage == "round"
    with person.play("second") as player:
        frame = player.hello()
        assert frame["phase"] == "paused"
        assert frame["tick"] >= 12
        assert player.until("paused")["reason"] == "left"
        player.send("ready")
        ended = player.until("ended")
        assert ended["outcome"] == "finished"
        assert [m["tick"] for m in player.received if m["type"] == "tick"] == list(
            range(frame["tick"] + 1, 41)
        )
    row = stored(served.store, person.token)
    assert (row.status, len(row.joint_actions)) == ("finished", 40)
    (pause,) = rows(served.store, PAUSES, row.id)
    assert (pause.tick, pause.reason) == (frame["tick"], "left")
    assert pause.ended_ms > pause.started_ms


def test_the_newest_tab_wins_and_input_is_never_doubled(served: Served, person: Participant) -> None:
    with person.play("old") as old, person.play("new") as new:
        old.hello()
        old.send("ready")
        old.until("tick", tick=5)
        new.hello()
        assert old.until("elsewhere")
        assert old.closed_with() == 4001
        new.send("ready")
        new.until("ended")
    row = stored(served.store, person.token)
    ticks = rows(served.store, TICKS, row.id)
    assert [tick.tick for tick in ticks] == list(range(40))


def test_bad_messages_are_refused_with_a_reason_and_the_round_goes_on(
    served: Served, person: Participant
) -> None:
    with person.play() as player:
        player.send("ready")
        assert "first message is hello" in player.until("refused")["reason"]
        player.hello()
        player.key("up", True)
        assert "waiting" in player.until("refused")["reason"]
        player.send("ready")
        player.until("tick")
        bad: list[tuple[str | bytes, str]] = [
            ("{", "JSON"),
            (b"\x00\xff", "text"),
            ("x" * 5000, "at most 1024"),
            ("x" * 100_000, "at most 1024"),
            ('{"type":"fly"}', "type is one of"),
            ('{"type":"ready"}', "not waiting for ready"),
            ('{"type":"hello","protocol":2,"tab":"x"}', "said already"),
            ('{"type":"key","key":"up","down":true,"seq":0,"client_ms":1}', "does not come after"),
        ]
        for text, reason in bad:
            player.socket.send(text)
            assert reason in player.until("refused")["reason"]
        assert player.until("ended")["outcome"] == "finished"
    assert len(stored(served.store, person.token).joint_actions) == 40


def test_ten_fuzzed_messages_a_tick_do_not_stop_the_round(served: Served, person: Participant) -> None:
    rng = np.random.default_rng(1)
    with person.play() as player:
        player.hello()
        player.send("ready")
        player.until("tick")
        for _ in range(300):
            size = int(rng.integers(0, 80))
            player.socket.send(rng.integers(32, 127, size, dtype=np.uint8).tobytes().decode())
        assert player.until("ended")["outcome"] == "finished"
    ticks = rows(served.store, TICKS, stored(served.store, person.token).id)
    assert np.allclose(np.diff([tick.deadline_ms for tick in ticks]), 20.0, atol=1e-3)


def test_another_protocol_version_is_refused_for_good(person: Participant) -> None:
    with person.play() as player:
        player.send("hello", protocol=99, tab="x")
        assert "protocol" in player.until("refused")["reason"]
        assert player.closed_with() == 4003


def test_a_frame_beyond_any_size_costs_the_connection_not_the_round(
    served: Served, person: Participant
) -> None:
    with person.play() as player:
        player.hello()
        player.send("ready")
        player.until("tick")
        player.socket.send("x" * 1_000_000)
        assert player.closed_with() == 1009
    with person.play() as player:
        assert player.hello()["phase"] == "paused"
        player.send("ready")
        assert player.until("ended")["outcome"] == "finished"


def test_unknown_links_and_other_sites_get_no_socket(served: Served, person: Participant) -> None:
    base = served.url.replace("http", "ws")
    with pytest.raises(InvalidStatus) as refused, Player(f"{base}/v/nobody/play", "x"):
        pass
    assert refused.value.response.status_code == 403
    with (
        pytest.raises(InvalidStatus) as refused,
        Player(f"{base}{person.path}/play", "x", origin="https://evil.example"),
    ):
        pass
    assert refused.value.response.status_code == 403
    with Player(f"{base}{person.path}/play", "x", origin=served.url) as player:
        assert player.hello()["phase"] == "waiting"


def test_a_visit_at_another_step_has_no_round_to_play(served: Served) -> None:
    someone = Participant(served)
    with someone.play() as player:
        player.send("hello", protocol=2, tab="x")
        assert player.closed_with() == 4002


def test_a_round_left_for_too_long_is_abandoned_and_the_visit_goes_on(
    served: Served, person: Participant
) -> None:
    with person.play() as player:
        player.hello()
        player.send("ready")
        player.until("tick", tick=7)
    wait_until(lambda: stored(served.store, person.token).status == "abandoned")
    assert 7 <= len(stored(served.store, person.token).joint_actions) < 40
    wait_until(lambda: person.load() is not None and person.stage == "debrief")


def test_pings_are_answered_with_the_servers_clock_and_stored(served: Served, person: Participant) -> None:
    with person.play() as player:
        player.hello()
        player.send("ping", client_ms=5.5, rtt_ms=None)
        pong = player.until("pong")
        assert pong["client_ms"] == 5.5
        assert abs(pong["server_ms"] - time.time() * 1000) < 5_000
    (clock,) = rows(served.store, CLOCKS, stored(served.store, person.token).id)
    assert (clock.client_ms, clock.rtt_ms) == (5.5, None)


class Naughty:
    """An agent whose decisions are made by a function of the tick."""

    def __init__(self, decide: Callable[[int], Any]) -> None:
        self._decide = decide

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        pass

    def act(self, state: NDArray[np.int16], tick: int) -> Any:
        return self._decide(tick)

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        pass


def crash(tick: int) -> int:
    if 10 <= tick < 20:
        raise ZeroDivisionError("a fault of the agent's own")
    return EAST


def nonsense(tick: int) -> Any:
    return {10: float("nan"), 11: 17, 12: None, 13: -1, 14: "up"}.get(tick, EAST)


def slow(tick: int) -> int:
    if tick == 10:
        time.sleep(0.15)
    return EAST


@pytest.mark.parametrize(
    ("decide", "fault", "bad"),
    [(crash, "error", range(10, 20)), (nonsense, "invalid", range(10, 15))],
)
def test_an_agent_that_crashes_or_decides_nonsense_stays_and_the_round_goes_on(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    decide: Callable[[int], Any],
    fault: str,
    bad: range,
) -> None:
    monkeypatch.setattr(Bundle, "make", lambda self: Naughty(decide))
    with serving(study_workspace(tmp_path / "lab", ONE_ROUND), tmp_path / "records.sqlite") as up:
        someone = Participant(up)
        someone.agree()
        with someone.play() as player:
            agent = 1 - player.hello()["seat"]
            player.send("ready")
            assert player.until("ended")["outcome"] == "finished"
        ticks = rows(up.store, TICKS, stored(up.store, someone.token).id)
    assert len(ticks) == 40
    for tick in ticks:
        if tick.late:
            continue  # a busy machine
        action = (tick.action_0, tick.action_1)[agent]
        assert (action, tick.fault) == ((STAY, fault) if tick.tick in bad else (EAST, None))
    assert "it stays where it is" in caplog.text


def test_a_slow_agent_costs_its_own_ticks_and_no_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Bundle, "make", lambda self: Naughty(slow))
    with serving(study_workspace(tmp_path / "lab", ONE_ROUND), tmp_path / "records.sqlite") as up:
        someone = Participant(up)
        someone.agree()
        with someone.play() as player:
            agent = 1 - player.hello()["seat"]
            player.send("ready")
            player.until("ended")
        ticks = rows(up.store, TICKS, stored(up.store, someone.token).id)
    assert [tick.tick for tick in ticks] == list(range(40))
    assert np.allclose(np.diff([tick.deadline_ms for tick in ticks]), 20.0, atol=1e-3)
    late = [tick.tick for tick in ticks if tick.late]
    assert 10 in late
    assert all((ticks[n].action_0, ticks[n].action_1)[agent] == STAY for n in late)
    assert not ticks[-1].late


def test_a_stopped_server_takes_the_round_up_where_it_was(tmp_path: Path) -> None:
    workspace, database = study_workspace(tmp_path / "lab", ONE_ROUND), tmp_path / "records.sqlite"
    with ExitStack() as open_sockets, serving(workspace, database) as up:
        someone = Participant(up)
        someone.agree()
        player = open_sockets.enter_context(someone.play())
        player.hello()
        player.send("ready")
        player.until("tick", tick=15)
    seen = [message for message in player.received if message["type"] == "tick"]
    with serving(workspace, database) as up:
        someone.served, someone.http = up, up.client()
        someone.load()
        assert someone.stage == "round"
        with someone.play() as player:
            frame = player.hello()
            assert frame["phase"] == "paused"
            assert frame["tick"] >= seen[-1]["tick"]
            assert player.until("paused")["reason"] == "restart"
            player.send("ready")
            assert player.until("ended")["outcome"] == "finished"
        row = stored(up.store, someone.token)
        ticks = rows(up.store, TICKS, row.id)
        pauses = rows(up.store, PAUSES, row.id)
    assert [tick.tick for tick in ticks] == list(range(40))
    assert {pause.reason for pause in pauses} == {"restart"}


def test_a_killed_server_loses_at_most_a_second_and_the_round_goes_on(tmp_path: Path) -> None:
    text = ONE_ROUND.replace("horizon_ticks: 40", "horizon_ticks: 150")
    workspace, database = study_workspace(tmp_path / "lab", text), tmp_path / "records.sqlite"
    url = f"sqlite:///{database}"
    with ExitStack() as opened, real_server(workspace.path, url) as server:
        up = Served(server.url, None, workspace, opened)  # type: ignore[arg-type]
        someone = Participant(up)
        someone.agree()
        with someone.play() as player:
            player.hello()
            player.send("ready")
            last = player.until("tick", tick=90)["tick"]
            os.kill(server.process.pid, signal.SIGKILL)
            server.process.wait()
    with real_server(workspace.path, url) as server:
        someone.served = Served(server.url, None, workspace)  # type: ignore[arg-type]
        with someone.play() as player:
            frame = player.hello()
            assert frame["phase"] == "paused"
            assert last - frame["tick"] <= 60, "50 ticks a second, and the commit takes its time"
            player.send("ready")
            assert player.until("ended")["outcome"] == "finished"
    assert server.process.returncode == 0, "told to stop, it stops cleanly"
    with Store.open(database) as store:
        visit = stored_visit(store, someone.token)
        assert visit is not None
        with store.reading() as connection:
            (number,) = queries.rounds_of_visit(connection, visit.id)
        assert [tick.tick for tick in rows(store, TICKS, number)] == list(range(150))
