"""Conditions stay even while people come and go: 1,000 arrivals, 50 at a time, 30% of whom drop out."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.records import Store
from galley.records.store import queries
from galley.study.study import Study, load_study
from galley.study.visit.condition_slots import cells
from galley.study.visit.plan import Plan
from tests.faults.balance import Recruiting, counted
from tests.study.workspaces import study_workspace
from tests.study.written.test_design import combination

ARRIVALS = 1000
QUOTA = 40
STUDY = """
format: 1
title: Six cells
seed: 17
slot_expires_min: 45
completion: {code: SIX-1}
factors:
  partner: {levels: [random, stay]}
  kitchen: {levels: [cramped_room, coordination_ring, counter_circuit]}
stages:
  - {kind: consent, text: consent}
  - kind: rounds
    agents: [$partner]
    layouts: [{layout: $kitchen}]
  - {kind: debrief, text: debrief}
"""


TOGETHER = """
format: 1
title: Every combination
seed: 19
slot_expires_min: 45
completion: {code: ALL-1}
factors:
  baseline: {levels: [random, stay]}
quota: 24
hats: [orange, sky-blue, bluish-green]
hat_order: full
together: [agent_order, seat_order, hat_order]
stages:
  - {kind: consent, text: consent}
  - kind: rounds
    agents: [myopic, $baseline]
    agent_order: full
    seat_order: full
    layouts: [{layout: cramped_room}]
  - {kind: debrief, text: debrief}
"""


def study(folder: Path, quota: int | None) -> Study:
    text = STUDY if quota is None else STUDY.replace("seed: 17\n", f"seed: 17\nquota: {quota}\n")
    return load_study(study_workspace(folder, text, "cells"), "cells")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store.open(f"sqlite:///{tmp_path}/records.sqlite", serving=True) as opened:
        yield opened


def test_cells_differ_by_at_most_one_at_every_moment(store: Store, tmp_path: Path) -> None:
    design = study(tmp_path / "lab", None)
    recruiting = Recruiting(store, design, random.Random(3))
    most_under_way, moments = 0, 0
    for _ in recruiting.events(ARRIVALS):
        sizes = [held + completed for held, completed in store.read(counted).result().values()]
        sizes += [0] * (len(cells(design.config)) - len(sizes))
        assert max(sizes) - min(sizes) <= 1, f"after {recruiting.arrived} arrivals"
        most_under_way = max(most_under_way, len(recruiting.under_way))
        moments += 1
    assert most_under_way == 50
    assert moments == 2 * ARRIVALS
    assert recruiting.why == {"new": ARRIVALS}
    left = recruiting.left
    assert 0.25 < (left["silent"] + left["declined"] + left["failed_checks"]) / ARRIVALS < 0.35
    assert left["silent"] > 100
    assert 0 < left["too late"] < 100, "some come back after their place was given away"
    completed = [done for _, done in store.read(counted).result().values()]
    assert sum(completed) == left["completed"]


def test_with_a_quota_every_cell_closes_with_exactly_that_many(store: Store, tmp_path: Path) -> None:
    design = study(tmp_path / "lab", QUOTA)
    recruiting = Recruiting(store, design, random.Random(4))
    for _ in recruiting.events(ARRIVALS):
        for held, completed in store.read(counted).result().values():
            assert held + completed <= QUOTA
    assert recruiting.arrived == ARRIVALS
    assert recruiting.why["later"] > 0, "places were all taken for a while"
    assert recruiting.why["full"] > 0, "and closed at the end"
    assert list(store.read(counted).result().values()) == [(0, QUOTA)] * 6


def test_completed_visits_have_every_combination_of_agent_order_seat_and_hats_equally_often(
    store: Store, tmp_path: Path
) -> None:
    design = load_study(study_workspace(tmp_path / "lab", TOGETHER, "cells"), "cells")
    recruiting = Recruiting(store, design, random.Random(5))
    for _ in recruiting.events(400):
        pass
    assert recruiting.why["full"] > 0
    assert sum(recruiting.left[how] for how in ("silent", "declined", "failed_checks")) > 10
    with store.reading() as connection:
        done = [row for row in queries.visits(connection, "cells") if row.status == "completed"]
    seen = Counter(combination(Plan.from_json(row.plan_json)) for row in done)
    assert len(seen) == 2 * 2 * 2 * 6
    assert set(seen.values()) == {1}
