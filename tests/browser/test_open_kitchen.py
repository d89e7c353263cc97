"""A person plays a round in a large open kitchen beside a planning robot, at the speed of studies."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchmarks.planning import OPEN
from tests.browser.participant import Participant
from tests.browser.site import ROOT, Site
from tests.serving import served

TICKS = 400
LAYOUT = """\
format: 1
title: Open kitchen
source: benchmarks/planning.py
rules:
  cook_time_ticks: 20
grid: |
"""
STUDY = """\
format: 1
title: An open kitchen
about: One round of a minute in a kitchen of 15 by 10.
seed: 3
tick_ms: 150
horizon_ticks: 400
countdown_s: 1
completion:
  code: OPEN-1
stages:
  - {kind: consent, text: consent}
  - kind: rounds
    agents: [ROBOT]
    layouts:
      - {layout: open_kitchen, goal: 40}
  - {kind: debrief, text: debrief}
"""


@pytest.fixture(params=["qmdp", "centralized"])
def site(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Site]:
    """A study of one round beside a planning robot."""
    lab = tmp_path / "lab"
    shutil.copytree(ROOT / "questionnaires", lab / "questionnaires")
    shutil.copytree(ROOT / "agents" / request.param, lab / "agents" / request.param)
    (lab / "layouts").mkdir()
    grid = "".join(f"  {row}\n" for row in OPEN.grid)
    (lab / "layouts" / "open_kitchen.yaml").write_text(LAYOUT + grid, encoding="utf-8")
    (lab / "studies").mkdir()
    study = STUDY.replace("ROBOT", request.param)
    (lab / "studies" / "open.yaml").write_text(study, encoding="utf-8")
    database = f"sqlite:///{tmp_path}/records.sqlite"
    with served(lab, database) as server:
        yield Site(server.url, "open", database, lab)


@pytest.mark.full
@pytest.mark.timeout(300)
def test_the_robot_is_never_late(newcomer: Callable[[str], Participant], site: Site, tmp_path: Path) -> None:
    participant = newcomer("open-kitchen")
    page = participant.page
    participant.begin(site.landing)
    participant.do_page()
    participant.presses.append([])
    cook = participant.start()
    participant.cook_until(cook, TICKS // 2)
    participant.shoot("middle", settle=False)
    page.set_viewport_size({"width": 390, "height": 844})
    participant.cook_until(cook, TICKS // 2 + 5)
    participant.shoot("middle-on-a-phone", settle=False)
    page.set_viewport_size({"width": 1280, "height": 800})
    participant.cook_until(cook, TICKS)
    participant.finish()
    assert participant.go_through() == "OPEN-1"

    visit = site.export(tmp_path / "out")
    (played,) = visit["rounds"]
    assert (played["status"], played["late_ticks"], played["fault_ticks"]) == ("finished", "0", "0")
    ticks = visit["ticks"]
    assert [int(tick["tick"]) for tick in ticks] == list(range(TICKS))
    assert {tick["late"] for tick in ticks} == {"false"}
    for who in ("partner", "human"):
        done = {tick[f"{who}_action"] for tick in ticks}
        assert {"north", "south", "east", "west", "interact"} <= done
    assert int(played["score"]) > 0
