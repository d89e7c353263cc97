"""Rounds keep their ticks whatever the network and the agents do: slow lines, and an agent of 300 ms."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from sqlalchemy import Connection, select

from galley.agents.scripted import Random
from galley.kitchen import STAY
from galley.records import Store
from galley.records.database.tables import ROUNDS, SEATS, TICKS
from galley.records.reading.verify import verify_study
from galley.simulate.simulation import Simulation, simulate
from tests.server.helpers import Served, serving
from tests.study.workspaces import study_workspace

HORIZON = 60
TICK_MS = 50
AGENT_S = 0.3
STUDY = f"""
format: 1
title: Slow
seed: 31
tick_ms: {TICK_MS}
horizon_ticks: {HORIZON}
countdown_s: 0
abandon_after_s: 20
completion: {{code: SLOW-1}}
stages:
  - {{kind: consent, text: consent}}
  - {{kind: rounds, agents: [random], layouts: [{{layout: cramped_room}}, {{layout: coordination_ring}}]}}
  - {{kind: debrief, text: debrief}}
"""


def slow_act(self: Random, state: NDArray[np.int16], tick: int) -> int:
    """As Random.act, but 300 ms later."""
    time.sleep(AGENT_S)
    return STAY + 1


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    workspace = study_workspace(tmp_path / "lab", STUDY, "slow")
    with serving(workspace, tmp_path / "records.sqlite") as up:
        yield up


def check_every_tick(store: Store, rounds: int, late: range) -> None:
    """Every round has each tick once, due at equal distances, and stay where the agent was late."""

    def read(connection: Connection) -> list[NDArray[np.float64]]:
        found = connection.execute(
            select(ROUNDS.c.id, ROUNDS.c.status, SEATS.c.seat).join(SEATS).where(SEATS.c.agent.is_not(None))
        )
        kept = []
        for row in found.all():
            assert row.status == "finished"
            acted = TICKS.c.action_0 if row.seat == 0 else TICKS.c.action_1
            query = select(TICKS.c.tick, TICKS.c.deadline_ms, TICKS.c.late, acted)
            ticks = connection.execute(query.where(TICKS.c.round_id == row.id).order_by(TICKS.c.tick))
            kept.append(np.array([tuple(tick) for tick in ticks], dtype=np.float64))
        return kept

    kept = store.read(read).result()
    assert len(kept) == rounds
    for ticks in kept:
        assert ticks[:, 0].tolist() == list(range(HORIZON))
        assert np.allclose(np.diff(ticks[:, 1]), TICK_MS, atol=0.01)
        assert set(ticks[ticks[:, 2] == 1, 3]) <= {STAY}
        assert int(ticks[:, 2].sum()) in late
    report = verify_study(store, "slow")
    assert report.ok, report
    assert report.rounds == rounds


@pytest.mark.parametrize("delay_ms", [0, 100, pytest.param(400, marks=pytest.mark.full)])
def test_a_slow_line_costs_no_tick(served: Served, delay_ms: int) -> None:
    wanted = Simulation("slow", 2, seed=delay_ms, in_flight=2, delay_ms=delay_ms)
    report = simulate(served.workspace, wanted, served.url)
    assert report["first_errors"] == []
    assert report["outcomes"] == {"completed": 2}
    assert report["lost_ticks"] == 0
    assert report["ticks"] == 4 * HORIZON
    if delay_ms:
        assert report["latency_ms"]["input_to_tick"]["p50"] >= 2 * delay_ms
        assert report["latency_ms"]["page"]["p50"] >= 2 * delay_ms
    check_every_tick(served.store, 4, range(HORIZON))


def test_a_slow_agent_costs_no_tick(monkeypatch: pytest.MonkeyPatch, served: Served) -> None:
    monkeypatch.setattr(Random, "act", slow_act)
    wanted = Simulation("slow", 1, seed=8, delay_ms=100)
    report = simulate(served.workspace, wanted, served.url)
    assert report["first_errors"] == []
    assert report["ticks"] == 2 * HORIZON
    check_every_tick(served.store, 2, range(HORIZON // 2, HORIZON + 1))
