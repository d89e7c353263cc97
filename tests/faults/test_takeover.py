"""Servers and databases that die in the middle of rounds: the participant goes on, and nothing is missing."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed

from galley.kitchen import Kitchen, Layout
from galley.protocol.scene import Scene
from galley.records import RoundRow, Store
from galley.records.reading.verify import verify_study
from galley.workspace import Workspace
from tests.postgres import Postgres, running
from tests.records.stored import stored_answers, stored_visit
from tests.server.helpers import Player, Served, serving
from tests.serving import Server
from tests.serving import served as serve
from tests.study.workspaces import study_workspace

TICK_MS = 40
TICKS = 100
STUDY = f"""
format: 1
title: One round
seed: 4
tick_ms: {TICK_MS}
horizon_ticks: {TICKS}
countdown_s: 0
abandon_after_s: 120
completion: {{code: ONE-1}}
stages:
  - {{kind: consent, text: consent}}
  - {{kind: questionnaire, id: open, questionnaire: open}}
  - {{kind: rounds, agents: [myopic], layouts: [{{layout: cramped_room}}]}}
  - {{kind: debrief, text: debrief}}
"""
OPEN = """
format: 1
title: A question
source: made for tests
items:
  - {id: why, kind: short_text, text: Why?}
"""


BOTH = (
    STUDY.replace("title: One round", "title: Two cooks")
    .replace("agents: [myopic]", "skippable: true, agents: [human]")
    .replace("  - {kind: questionnaire, id: open, questionnaire: open}\n", "")
)


def lab(folder: Path) -> Path:
    workspace = study_workspace(folder / "lab", STUDY)
    (workspace.path / "questionnaires" / "open.yaml").write_text(OPEN, encoding="utf-8")
    (workspace.path / "studies" / "both.yaml").write_text(BOTH, encoding="utf-8")
    return workspace.path


def two_at_the_round(server: Server | Served, other: Server | None = None) -> tuple[str, str]:
    """The paths of two new visits that were paired, the second of whom came to the other server."""
    servers = (server, other or server)
    with httpx.Client(follow_redirects=True, timeout=30) as http:
        paths = []
        for at in servers:
            page = http.post(f"{at.url}/s/both/begin")
            paths.append(page.url.path)
            page = http.post(str(page.url), data={"step": "consent", "choice": "agree"})
            assert f'data-stage="{"round" if len(paths) == 2 else "lobby"}"' in page.text
        pages = [http.get(at.url + path) for at, path in zip(servers, paths, strict=True)]
        assert all('data-stage="round"' in page.text for page in pages)
    return paths[0], paths[1]


def play_together(one: Player, two: Player, tick: int) -> None:
    one.hello()
    two.hello()
    one.send("ready")
    two.send("ready")
    one.until("tick", tick=tick)


def at_the_round(server: Server) -> str:
    """The path of a new visit that has come to its round."""
    with httpx.Client(base_url=server.url, follow_redirects=True, timeout=30) as http:
        path = http.post("/s/mine/begin").url.path
        http.post(path, data={"step": "consent", "choice": "agree"})
        page = http.post(path, data={"step": "open", "why": "soup"})
        assert 'data-stage="round"' in page.text
        return path


def player(server: Server | Served, path: str, tab: str = "tab") -> Player:
    return Player(f"{server.url.replace('http', 'ws')}{path}/play", tab)


def play_until(one: Player, tick: int) -> None:
    """Play, pressing a key now and then, until this tick."""
    one.hello()
    one.send("ready")
    while (now := one.until("tick")["tick"]) < tick:
        one.key(("right", "left", "interact", "up")[now // 3 % 4], now % 3 == 0)


def go_on(server: Server, path: str, tab: str = "tab") -> tuple[dict[str, Any], dict[str, Any]]:
    """The first picture that a browser gets that comes back, and the end of the round it then plays."""
    with player(server, path, tab) as one:
        frame = one.hello()
        one.send("ready")
        return frame, one.until("ended")


def until_it_goes(attempt: Callable[[], Any], seconds: float = 60.0) -> Any:
    """What `attempt` gives once it works, as a browser that connects again and again."""
    end = time.monotonic() + seconds
    while True:
        try:
            return attempt()
        except (OSError, ConnectionClosed, TimeoutError, httpx.HTTPError):
            if time.monotonic() > end:
                raise
            time.sleep(0.2)


def checked(database: str, path: str) -> RoundRow:
    """The visit's round as stored: whole, replaying bit for bit, every answer there."""
    with Store.open(database) as store:
        visit = stored_visit(store, path.rsplit("/", 1)[1])
        assert visit is not None
        assert (visit.status, visit.completion_code) == ("completed", "ONE-1")
        assert stored_answers(store, visit.id) == {"open": {"why": "soup"}}
        row = store.open_round(visit.id, "rounds-1").result()
        assert row is not None
        assert (row.status, len(row.joint_actions)) == ("finished", TICKS)
        report = verify_study(store, "mine")
        assert report.ok, str(report)
        return row


def whole(database: str, study: str, path: str) -> None:
    """The visit's round has every tick and replays bit for bit."""
    with Store.open(database) as store:
        visit = stored_visit(store, path.rsplit("/", 1)[1])
        assert visit is not None
        row = store.open_round(visit.id, "rounds-1").result()
        assert row is not None
        assert (row.status, len(row.joint_actions)) == ("finished", TICKS)
        report = verify_study(store, study)
        assert report.ok, str(report)


def debrief(server: Server, path: str) -> None:
    assert "ONE-1" in httpx.get(server.url + path, timeout=30).text


def ticks_of_a_second() -> int:
    return round(1000 / TICK_MS)


@pytest.fixture(scope="module")
def postgres() -> Iterator[Postgres]:
    with running() as server:
        server.execute("CREATE DATABASE two")
        yield server


@pytest.fixture(scope="module")
def pair(postgres: Postgres, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, Server]]:
    """Two server processes on one database."""
    folder = lab(tmp_path_factory.mktemp("takeover"))
    url = postgres.url("two")
    with ExitStack() as up:
        yield up.enter_context(serve(folder, url)), up.enter_context(serve(folder, url))


def test_a_participant_may_change_servers_in_mid_round(
    postgres: Postgres, pair: tuple[Server, Server]
) -> None:
    one, two = pair
    path = at_the_round(one)
    with player(one, path, "old") as old:
        play_until(old, 30)
        frame, ended = go_on(two, path, "new")
        assert (frame["phase"], ended["outcome"]) == ("paused", "finished")
        assert old.closed_with() == 4001
        assert old.received[-1] == {"type": "elsewhere"}
    assert 30 - ticks_of_a_second() <= frame["tick"] <= max(m["tick"] for m in old.received if "tick" in m)
    debrief(one, path)
    checked(postgres.url("two"), path)


def test_a_database_that_restarts_in_mid_round_costs_nothing(
    postgres: Postgres, pair: tuple[Server, Server]
) -> None:
    path = at_the_round(pair[0])
    with player(pair[0], path) as one:
        play_until(one, 20)
        postgres.stop("immediate")
        one.until("tick", tick=60)
        postgres.start()
        assert one.until("ended")["outcome"] == "finished"
        ticks = [message["tick"] for message in one.received if message["type"] == "tick"]
    assert ticks == list(range(1, TICKS + 1)), "the participant noticed nothing"
    debrief(pair[0], path)
    checked(postgres.url("two"), path)


def test_a_round_of_two_people_stays_with_its_server_while_that_lives(
    postgres: Postgres, pair: tuple[Server, Server]
) -> None:
    paths = two_at_the_round(pair[0])
    with player(pair[0], paths[0]) as one:
        with player(pair[0], paths[1]) as two:
            play_together(one, two, 20)
        assert one.until("paused")["reason"] == "partner"
        frame, ended = go_on(pair[1], paths[1])
        assert frame["phase"] == "paused"
        assert ended["outcome"] == one.until("ended")["outcome"] == "finished"
    whole(postgres.url("two"), "both", paths[0])


def test_two_people_who_came_to_different_servers_are_paired_and_play(
    postgres: Postgres, pair: tuple[Server, Server]
) -> None:
    paths = two_at_the_round(*pair)
    with player(pair[0], paths[0], "a") as one, player(pair[1], paths[1], "b") as two:
        play_together(one, two, 20)
        two.key("right", True)
        one.key("left", True)
        assert one.until("ended")["outcome"] == two.until("ended")["outcome"] == "finished"
        seen = [[m for m in p.received if m["type"] == "tick"] for p in (one, two)]
    assert seen[0] == seen[1]
    assert [message["tick"] for message in seen[0]] == list(range(1, TICKS + 1))
    debrief(pair[1], paths[0])
    debrief(pair[0], paths[1])
    whole(postgres.url("two"), "both", paths[0])
    with Store.open(postgres.url("two")) as store:
        rows = [stored_visit(store, path.rsplit("/", 1)[1]) for path in paths]
        rounds = [store.open_round(row.id, "rounds-1").result() for row in rows if row is not None]
        assert rounds[0] is not None
        assert rounds[1] is not None
        assert rounds[0].id == rounds[1].id
        assert (rounds[0].joint_actions != 4).any(axis=0).all(), "the keys of both arrived"


def test_who_leaves_at_another_server_is_missed_at_once(
    postgres: Postgres, pair: tuple[Server, Server]
) -> None:
    paths = two_at_the_round(*pair)
    with player(pair[0], paths[0], "a") as one:
        with player(pair[1], paths[1], "b") as two:
            play_together(one, two, 10)
        assert one.until("paused")["reason"] == "partner"
        page = httpx.post(
            pair[1].url + paths[1], data={"step": "rounds-1", "skip": "1"}, follow_redirects=True, timeout=30
        )
        assert page.status_code == 200
        assert 'data-stage="debrief"' in page.text
        assert one.until("ended")["outcome"] == "partner_left"
    debrief(pair[1], paths[0])


def test_people_who_come_to_two_servers_at_once_are_each_paired_once(
    postgres: Postgres, pair: tuple[Server, Server]
) -> None:
    def come(number: int) -> str:
        at = pair[number % 2].url
        with httpx.Client(follow_redirects=True, timeout=30) as http:
            path = http.post(f"{at}/s/both/begin").url.path
            http.post(at + path, data={"step": "consent", "choice": "agree"})

            def asks() -> None:
                if http.get(f"{at}{path}/lobby").json()["waiting"]:
                    raise TimeoutError

            until_it_goes(asks)
        return path

    with ThreadPoolExecutor(8) as people:
        paths = list(people.map(come, range(8)))
    with Store.open(postgres.url("two")) as store:
        visits = [stored_visit(store, path.rsplit("/", 1)[1]) for path in paths]
        rounds = [store.open_round(visit.id, "rounds-1").result() for visit in visits if visit is not None]
        ids = [row.id for row in rounds if row is not None]
    assert len(ids) == 8
    assert all(ids.count(one) == 2 for one in ids)


def test_a_round_whose_server_dies_is_finished_at_another(
    postgres: Postgres, pair: tuple[Server, Server]
) -> None:
    one, two = pair
    path, paths = at_the_round(one), two_at_the_round(one, two)
    with player(one, path) as before, player(one, paths[0]) as left, player(two, paths[1]) as right:
        play_together(left, right, 5)
        play_until(before, 50)
        one.process.kill()
        one.process.wait()
        before.closed_with()
    last = max(message["tick"] for message in before.received if message["type"] == "tick")
    frame, ended = until_it_goes(lambda: go_on(two, path))
    assert (frame["phase"], ended["outcome"]) == ("paused", "finished")
    assert last - ticks_of_a_second() <= frame["tick"] <= last + 1
    debrief(two, path)
    row = checked(postgres.url("two"), path)
    # Two people both get there once the dead server's lease has run out.
    with ThreadPoolExecutor(2) as people:
        ends = people.map(lambda path: until_it_goes(lambda: go_on(two, path))[1]["outcome"], paths)
    assert list(ends) == ["finished", "finished"]
    whole(postgres.url("two"), "both", paths[0])
    # What had been stored of the first server's ticks is what the participant saw there.
    shown = [message for message in before.received if message["type"] == "tick"]
    seen = {message["tick"]: message["chefs"] for message in shown}
    assert _chefs_after(row, frame["tick"]) == seen[frame["tick"]] == frame["chefs"]


def _chefs_after(row: RoundRow, tick: int) -> list[list[int]]:
    layout = Layout.from_dict(json.loads(row.layout_json))
    kitchen = Kitchen(layout)
    for joint in row.joint_actions[:tick].tolist():
        kitchen.step(*joint)
    return Scene(layout).chefs(kitchen.state)


def test_killing_the_one_server_on_a_file_loses_a_second_at_most_and_no_answer(tmp_path: Path) -> None:
    folder, database = lab(tmp_path), str(tmp_path / "records.sqlite")
    with serve(folder, database) as first:
        path = at_the_round(first)
        with player(first, path) as before:
            play_until(before, 50)
            first.process.kill()
            first.process.wait()
            before.closed_with()
    last = max(message["tick"] for message in before.received if message["type"] == "tick")
    with serve(folder, database) as second:
        frame, ended = go_on(second, path)
        assert (frame["phase"], ended["outcome"]) == ("paused", "finished")
        assert last - ticks_of_a_second() <= frame["tick"] <= last + 1
        debrief(second, path)
    checked(database, path)


def test_a_server_that_is_shut_down_gives_its_rounds_back_at_once(postgres: Postgres, tmp_path: Path) -> None:
    postgres.execute("CREATE DATABASE calm")
    workspace, url = Workspace(lab(tmp_path)), postgres.url("calm")
    with serving(workspace, url) as first:
        paths = two_at_the_round(first)
        with player(first, paths[0]) as one, player(first, paths[1]) as two:
            play_together(one, two, 10)
    with serving(workspace, url) as second, player(second, paths[0]) as one, player(second, paths[1]) as two:
        assert [back.hello()["phase"] for back in (one, two)] == ["paused", "paused"], "no wait for the lease"
        one.send("ready")
        two.send("ready")
        assert one.until("ended")["outcome"] == "finished"
    whole(url, "both", paths[0])
