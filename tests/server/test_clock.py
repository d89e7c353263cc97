"""Times of records: right after a sleep or a clock that was set, and durations that are never negative."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from sqlalchemy import select, update

from galley.errors import GalleyError
from galley.records import Store
from galley.records.database.tables import STAGES, VISITS
from galley.records.export.study_export import export_study
from galley.records.reading.flags import flags
from galley.records.reading.overdue import WallTime
from galley.records.reading.overview import stages
from galley.server import clock as clocks
from galley.server.clock import Clock, Following, WakingClock
from tests.records.helpers import begin
from tests.server.helpers import Participant, serving
from tests.study.workspaces import study_workspace

HOUR_S = 3600.0
START_S = 1_700_000_000.0
STUDY = """
format: 1
title: Pages
seed: 4
completion: {code: DONE-1}
stages:
  - {kind: consent, text: consent}
  - {kind: instructions, text: instructions}
  - {kind: debrief, text: debrief}
"""


class Machine:
    """A machine's clocks, in place of the module `time`; `tells_sleep` is whether it has CLOCK_BOOTTIME."""

    def __init__(self, tells_sleep: bool = True) -> None:
        self.wall_s = START_S
        self.awake_s = 100.0
        self.up_s = 100.0
        if tells_sleep:
            self.CLOCK_BOOTTIME = 7

    def time(self) -> float:
        return self.wall_s

    def monotonic(self) -> float:
        return self.awake_s

    def clock_gettime(self, which: int) -> float:
        assert which == 7
        return self.up_s

    def passes(self, seconds: float) -> None:
        """Time passes while the machine is awake."""
        self.wall_s += seconds
        self.up_s += seconds
        self.awake_s += seconds

    def sleeps(self, seconds: float) -> None:
        """Time passes while the machine sleeps."""
        self.wall_s += seconds
        self.up_s += seconds


class Shelf:
    """A store that answers with what a machine's wall clock says and the latest time that is recorded."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.latest_ms: float | None = None
        self.away: Exception | None = None

    def read(self, query: Callable[..., object]) -> object:
        loop = asyncio.get_running_loop()
        answer = loop.create_future()
        if self.away is not None:
            answer.set_exception(self.away)
        elif query is clocks.wall_time:
            answer.set_result(WallTime(self.machine.wall_s * 1000, self.machine.awake_s))
        else:
            answer.set_result(self.latest_ms)
        return answer


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Machine:
    made = Machine()
    monkeypatch.setattr(clocks, "time", made)
    return made


class Serving:
    """The clocks of a server on a machine."""

    def __init__(self, machine: Machine, latest_ms: float | None = None) -> None:
        self.store = Shelf(machine)
        self.store.latest_ms = latest_ms
        self.pages, self.rounds = WakingClock(), Clock()
        self.plays = False
        self.following = Following(self.store, self.pages, self.rounds, lambda: self.plays)  # type: ignore[arg-type]
        self.look()

    def look(self) -> None:
        asyncio.run(self.following.look())


def off_s(clock: Clock, machine: Machine) -> float:
    """How far a clock is ahead of the wall clock."""
    return clock.ms() / 1000 - machine.wall_s


def test_f11_times_are_right_at_once_after_eight_hours_of_sleep(machine: Machine) -> None:
    server = Serving(machine)
    machine.sleeps(8 * HOUR_S)
    assert off_s(server.pages, machine) == pytest.approx(0, abs=0.01)
    assert off_s(server.rounds, machine) == pytest.approx(-8 * HOUR_S), "before it was measured again"
    server.look()
    assert off_s(server.rounds, machine) == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("jump_s", [8 * HOUR_S, 30.0, 0.2])
def test_f11_a_clock_set_forward_or_a_sleep_that_no_system_tells_is_followed(
    monkeypatch: pytest.MonkeyPatch, jump_s: float
) -> None:
    machine = Machine(tells_sleep=False)
    monkeypatch.setattr(clocks, "time", machine)
    server = Serving(machine)
    machine.sleeps(jump_s)
    server.look()
    for clock in (server.pages, server.rounds):
        assert off_s(clock, machine) == pytest.approx(0, abs=0.01)


def test_f11_within_a_round_no_time_is_measured_again(machine: Machine) -> None:
    server = Serving(machine)
    server.plays = True
    first_ms = server.rounds.ms(machine.awake_s)
    machine.wall_s += HOUR_S
    server.look()
    machine.passes(0.15)
    assert server.rounds.ms(machine.awake_s) - first_ms == pytest.approx(150)
    assert off_s(server.pages, machine) == pytest.approx(0, abs=0.01)
    server.plays = False
    server.look()
    assert off_s(server.rounds, machine) == pytest.approx(0, abs=0.01)


def test_a15_a_clock_set_back_is_not_followed_until_no_visit_under_way_has_a_later_time(
    machine: Machine, caplog: pytest.LogCaptureFixture
) -> None:
    server = Serving(machine)
    seen_ms = server.store.latest_ms = server.pages.ms()
    machine.wall_s -= HOUR_S
    for _ in range(3):
        machine.passes(60)
        server.look()
    assert server.pages.ms() - seen_ms == pytest.approx(180_000), "just as long as it took"
    assert caplog.text.count("behind what is recorded") == 1, "told once"
    machine.passes(HOUR_S)
    server.look()
    assert off_s(server.pages, machine) == pytest.approx(0, abs=0.01), "nothing recorded lies ahead any more"
    assert off_s(server.rounds, machine) == pytest.approx(0, abs=0.01)


def test_a15_after_a_restart_with_the_clock_set_back_times_go_on_from_the_latest(machine: Machine) -> None:
    seen_ms = (START_S + HOUR_S) * 1000
    server = Serving(machine, latest_ms=seen_ms)
    assert server.pages.ms() == pytest.approx(seen_ms)
    assert server.rounds.ms() == pytest.approx(seen_ms)


def test_a15_a_time_of_the_far_future_binds_nobody(machine: Machine) -> None:
    server = Serving(machine, latest_ms=(START_S + 400 * 24 * HOUR_S) * 1000)
    assert off_s(server.pages, machine) == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("away", [GalleyError("away"), ValueError("refused")])
def test_a15_while_the_database_is_away_times_go_on(machine: Machine, away: Exception) -> None:
    server = Serving(machine)
    before_ms = server.rounds.ms()
    server.store.away = away
    machine.passes(5)
    server.look()
    assert server.rounds.ms() - before_ms == pytest.approx(5000)


def test_a15_a_visit_across_a_restart_with_the_clock_an_hour_back_has_no_negative_duration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workspace = study_workspace(tmp_path / "lab", STUDY)
    database = tmp_path / "records.sqlite"
    with serving(workspace, database) as up:
        person = Participant(up)
        token = person.token
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() - HOUR_S)
    with serving(workspace, database) as up:
        client = up.client()
        client.post(f"/v/{token}", data={"step": "consent", "choice": "agree"})
        with up.store.reading() as connection:
            rows = connection.execute(select(STAGES.c.entered_ms, STAGES.c.left_ms)).all()
    assert [0 <= row.left_ms - row.entered_ms < 60_000 for row in rows if row.left_ms] == [True]


def test_a15_durations_of_older_records_that_ran_backwards_are_flagged_and_empty(tmp_path: Path) -> None:
    with Store.open(tmp_path / "records.sqlite") as store:
        visit = begin(store)
        at_ms = visit.created_ms
        store.enter_step(visit.id, "consent", at_ms).result()
        store.save_answers(visit.id, "consent", {}, 1, "active", at_ms + 5000).result()
        store.left_page(visit.id, "consent", at_ms + 90_000).result()
        store.back_on_page(visit.id, at_ms + 80_000).result()
        store.write(
            lambda connection: connection.execute(update(STAGES).values(left_ms=at_ms - 3_600_000))
        ).result()
        with store.reading() as connection:
            found = flags(connection, visit.study)[visit.id]
            (stage,) = stages(connection, visit.study)
            ended = connection.execute(select(VISITS.c.ended_ms)).scalar()
        assert [(flag.kind, flag.value) for flag in found] == [("clock_set_back", 2.0)]
        assert stage.median_s is None
        assert ended is None
        export_study(store, visit.study, tmp_path / "out")
    header, *lines = (tmp_path / "out" / "stages.csv").read_text(encoding="utf-8").splitlines()
    duration = header.split(",").index("duration_s")
    assert [line.split(",")[duration] for line in lines] == [""]
