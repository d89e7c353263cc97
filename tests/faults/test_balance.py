"""Conditions stay even while people come and go: 1,000 arrivals, 50 at a time, 30% of whom drop out."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.records import Store
from galley.study.assignment import cells
from galley.study.study import Study, load_study
from tests.faults.balance import Recruiting, counted
from tests.study.workspaces import study_workspace

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
