"""Real processes on one SQLite file: a second server is refused, a killed one loses no answer."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.errors import GalleyError
from galley.records import Store
from galley.records.reading.verify import verify_study
from tests.records.helpers import begin, joint_actions

SERVING = Path(__file__).with_name("serving.py")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "galley.sqlite"


@pytest.fixture
def server(file: Path) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen([sys.executable, SERVING, file], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        assert process.stdout.readline().startswith("serving")
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def stored(file: Path, query: str) -> list[int]:
    connection = sqlite3.connect(file)
    try:
        return [row[0] for row in connection.execute(query)]
    finally:
        connection.close()


def kill(server: subprocess.Popen[str]) -> list[list[str]]:
    """What the server said it did until it was killed."""
    server.send_signal(signal.SIGKILL)
    assert server.stdout is not None
    lines = server.stdout.read().split("\n")[:-1]
    assert server.wait() == -signal.SIGKILL
    return [line.split() for line in lines]


def test_a_second_server_is_refused_until_the_first_is_dead(
    server: subprocess.Popen[str], file: Path
) -> None:
    with pytest.raises(GalleyError, match=f"process {server.pid} already serves") as caught:
        Store.open(file, serving=True)
    assert "\n" not in str(caught.value)
    second = subprocess.run([sys.executable, SERVING, file], capture_output=True, text=True, check=False)
    assert second.returncode == 1
    assert second.stderr == f"{caught.value}\n"
    kill(server)
    with Store.open(file, serving=True) as store:
        assert begin(store).visit_no == 1


def test_a_served_database_can_be_read_by_others(server: subprocess.Popen[str], file: Path) -> None:
    with Store.open(file, must_exist=True) as store:
        assert verify_study(store, "demo").open == 1


def test_a_killed_server_loses_no_answer_and_no_tick_in_the_middle(
    server: subprocess.Popen[str], file: Path
) -> None:
    patience = time.monotonic() + 30
    while len(stored(file, "SELECT tick FROM ticks")) < 20:
        assert time.monotonic() < patience, "no tick was ever written"
        time.sleep(0.02)
    told = kill(server)
    ticks = stored(file, "SELECT tick FROM ticks ORDER BY tick")
    assert ticks == list(range(len(ticks)))
    answers = {line[1] for line in told if line[0] == "answer"}
    assert answers
    assert answers <= set(stored(file, "SELECT value FROM responses"))
    with Store.open(file, serving=True) as store:
        row = store.open_round(1, "rounds-1").result()
        assert row is not None
        assert row.joint_actions.tolist() == [list(pair) for pair in joint_actions(1, 5000)[: len(ticks)]]


@pytest.mark.full
def test_a_killed_server_loses_at_most_one_second_of_ticks(server: subprocess.Popen[str], file: Path) -> None:
    time.sleep(4.3)
    killed = time.monotonic()
    told = kill(server)
    ticks = set(stored(file, "SELECT tick FROM ticks"))
    journalled = {int(line[1]): float(line[2]) for line in told if line[0] == "tick"}
    lost = [killed - at for tick, at in journalled.items() if tick not in ticks]
    assert len(journalled) > 300
    assert max(lost, default=0.0) <= 1.0
