"""Evaluations on a Dask cluster whose scheduler and workers were each started by hand."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from distributed import Client

from galley.errors import GalleyError
from galley.evaluation.many_layouts import evaluate_many
from galley.evaluation.teams import Team
from galley.kitchen import Layout

TEAM = Team(epsilon=0.1, trials=4, horizon_ticks=60, seed=4)
ROOM = "XXP{0}\nO  {1}2O\nX1 {1} X\nXDS{0}"
ROOMS = [Layout.from_ascii(f"room-{more}", ROOM.format("X" * (more + 2), " " * more)) for more in range(1, 9)]
UP_S = 60


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[str]:
    """The address of a scheduler with two workers: three processes that share nothing but it."""
    where = tmp_path / "address"
    with ExitStack() as ends, (tmp_path / "log").open("wb") as log:

        def begin(*command: str) -> None:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *command], stdout=log, stderr=subprocess.STDOUT, cwd=tmp_path
            )
            ends.callback(process.wait, 20)
            ends.callback(process.terminate)

        begin(
            "scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            str(where),
        )
        until = time.monotonic() + UP_S
        while not where.exists() and time.monotonic() < until:
            time.sleep(0.05)
        with Client(scheduler_file=str(where), timeout=UP_S) as client:
            address = str(client.scheduler.address)
            for _ in range(2):
                begin("worker", address, "--nworkers", "1", "--nthreads", "1", "--no-dashboard")
            client.wait_for_workers(2, timeout=UP_S)
        yield address


def test_results_are_those_of_one_process(scheduler: str) -> None:
    told: list[int] = []
    assert evaluate_many(ROOMS, TEAM, scheduler=scheduler, on_done=told.append) == evaluate_many(ROOMS, TEAM)
    assert told == list(range(1, len(ROOMS) + 1))
    with Client(scheduler) as client:
        work = client.run(lambda dask_worker: (os.getpid(), dask_worker.state.transition_counter))
    assert len({pid for pid, _ in work.values()} - {os.getpid()}) == 2
    assert all(transitions > 0 for _, transitions in work.values()), "both had their share"


def test_a_kitchen_that_cannot_be_served_is_told_as_in_one_process(scheduler: str) -> None:
    dry = Layout.from_ascii("dry", "XXPXX\nO  2O\nX1  X\nXDXXX")
    with pytest.raises(GalleyError, match="'dry' has no serving place"):
        evaluate_many([ROOMS[0], dry], TEAM, scheduler=scheduler)


@pytest.mark.full
def test_a_scheduler_that_is_not_there_is_told() -> None:
    with pytest.raises(GalleyError, match=r"does not answer.*dask scheduler"):
        evaluate_many(ROOMS, TEAM, scheduler="tcp://127.0.0.1:9")
