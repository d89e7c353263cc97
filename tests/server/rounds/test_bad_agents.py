"""One bad agent costs its own rounds their partner, and nobody else anything (A3).

Networks that pass every check and then, in the middle of a round, never return, take two seconds, fail, or
want more memory than there is.
"""

from __future__ import annotations

import signal
import threading
import time
from collections import Counter
from pathlib import Path

import httpx
import pytest
from sqlalchemy import select

from galley.errors import GalleyError
from galley.records.database.tables import SEATS, TICKS
from galley.server.content import load_content
from galley.workspace import Workspace
from tests.records.stored import stored_visit
from tests.server.helpers import Participant, Player, Served, serving, wait_until
from tests.server.rounds.bad_agents import GOOD_UNTIL_TICKS_LEFT, LAYOUT, write_bad_agents
from tests.serving import run_galley
from tests.serving import served as served_alone
from tests.study.workspaces import study_workspace

LENGTH, TICK_MS = 120, 100
STUDY = """
format: 1
title: One round
seed: 4
tick_ms: {tick_ms}
horizon_ticks: {ticks}
countdown_s: 0
abandon_after_s: 60
completion: {{code: ONE-1}}
factors:
  partner: {{levels: [{agents}]}}
stages:
  - {{kind: consent, text: consent}}
  - {{kind: rounds, agents: [$partner], layouts: [{{layout: {layout}}}]}}
  - {{kind: debrief, text: debrief}}
"""
GOOD = ("random", "myopic", "human-bc")


def workspace(folder: Path, agents: tuple[str, ...]) -> Workspace:
    """A workspace with the bad agents, whose study meets these."""
    study = STUDY.format(tick_ms=TICK_MS, ticks=LENGTH, agents=", ".join(agents), layout=LAYOUT)
    made = study_workspace(folder, study)
    write_bad_agents(made.folder("agents"), made.folder("layouts"))
    return made


def play(people: list[Participant]) -> None:
    """Everybody plays the round through, at the same time."""

    def one(number: int, person: Participant) -> None:
        with person.play(f"tab-{number}") as player:
            player.hello()
            player.send("ready")
            while player.next()["type"] != "ended":
                pass

    threads = [threading.Thread(target=one, args=pair) for pair in enumerate(people)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)


def people_with(served: Served, agents: dict[str, int]) -> dict[str, list[Participant]]:
    """So many participants at a round with each agent."""
    found: dict[str, list[Participant]] = {agent: [] for agent in agents}
    while any(len(found[agent]) < many for agent, many in agents.items()):
        person = Participant(served)
        row = stored_visit(served.store, person.token)
        assert row is not None
        agent = row.condition["partner"]
        if len(found[agent]) < agents[agent]:
            person.agree()
            found[agent].append(person)
    return found


def test_a3_no_bad_agent_costs_others_a_tick(tmp_path: Path) -> None:
    bad = ("never", "slow", "fails", "hungry")
    made = workspace(tmp_path / "lab", (*bad, *GOOD))
    health: list[httpx.Response] = []
    with serving(made, tmp_path / "records.sqlite") as served:
        http = served.client()
        found = people_with(served, dict.fromkeys(bad, 1) | {"random": 7, "myopic": 7, "human-bc": 6})
        over = threading.Event()

        def look() -> None:
            while not over.wait(0.1):
                health.append(http.get("/healthz"))

        looking = threading.Thread(target=look)
        looking.start()
        play([person for people in found.values() for person in people])
        wait_until(lambda: "never" in http.get("/healthz").json()["given_up"])
        over.set()
        looking.join()
        for people in found.values():
            for person in people:
                person.load()
                assert person.stage == "debrief"
        with served.store.reading() as connection:
            agents = select(SEATS.c.round_id, SEATS.c.agent).where(SEATS.c.agent.is_not(None))
            agent_of = {row.round_id: row.agent for row in connection.execute(agents)}
            ticks = connection.execute(TICKS.select()).all()
    late, faults = Counter[str](), Counter[str]()
    for tick in ticks:
        late[agent_of[tick.round_id]] += tick.late
        faults[agent_of[tick.round_id]] += tick.fault is not None
    assert len(ticks) == LENGTH * (len(bad) + 20)
    # All share this machine with who plays: some ticks may be late, but not a round's last third, as they
    # would be behind a bad agent.
    assert sum(late[name] for name in GOOD) < 0.2 * LENGTH * 20
    assert {name: faults[name] for name in GOOD} == dict.fromkeys(GOOD, 0)
    harmful = GOOD_UNTIL_TICKS_LEFT - 1
    assert faults["fails"] >= harmful / 2
    assert faults["hungry"] >= harmful / 2
    assert late["slow"] + faults["slow"] >= harmful / 2
    assert late["never"] + faults["never"] >= harmful / 2
    assert health[0].json()["given_up"] == {}
    assert any("galley-thinking-never" in one.json()["stuck"] for one in health if one.status_code == 503)


def test_a3_a_server_with_an_agent_that_never_returns_stops_in_time(tmp_path: Path) -> None:
    made = workspace(tmp_path / "lab", ("never", "stay"))
    database = f"sqlite:///{tmp_path}/records.sqlite"
    with served_alone(made.path, database) as server, httpx.Client(base_url=server.url) as http:
        page = http.post("/s/mine/begin", follow_redirects=True)
        http.post(page.url.path, data={"step": "consent", "choice": "agree"})
        player = Player(server.url.replace("http", "ws") + f"{page.url.path}/play", "tab")
        with player:
            player.hello()
            player.send("ready")
            player.until("tick", tick=LENGTH - GOOD_UNTIL_TICKS_LEFT + 8)
            start = time.monotonic()
            server.process.send_signal(signal.SIGTERM)
            assert server.process.wait(10) == 0
            assert time.monotonic() - start < 5.0
    told = run_galley("trajectories", "verify", "mine", "--database", database)
    assert told.returncode == 0, told.stderr


def test_a3_an_agent_that_never_returns_keeps_no_server_from_saying_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("galley.server.content.MADE_READY_WITHIN_S", 1.0)
    made = workspace(tmp_path / "lab", ("never", "stay"))
    study = made.folder("studies") / "mine.yaml"
    study.write_text(study.read_text().replace(f"horizon_ticks: {LENGTH}", "horizon_ticks: 20"))
    with pytest.raises(GalleyError, match="agents/never: 3 decisions on each seat of layout cramped_room"):
        load_content(made)
