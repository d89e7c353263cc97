"""A real Chromium plays a whole short study against a real server, by keyboard; its records are opened."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.browser.participant import SETTLE_MS, Participant
from tests.browser.site import ROOT, Site, check_answered, check_played, newest_visit, open_site

TICKS = 40


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    study = ROOT / "tests" / "workspaces" / "short" / "studies" / "short.yaml"
    with open_site(tmp_path_factory.mktemp("short"), study) as opened:
        yield opened


def test_from_landing_to_completion_code(
    newcomer: Callable[[str], Participant], site: Site, tmp_path: Path
) -> None:
    participant = newcomer("short")
    participant.begin(site.landing)
    code = participant.go_through()
    token = participant.page.url.rsplit("/", 1)[1]

    visit = newest_visit(site.export(tmp_path / "out"))
    assert [(row["completion_code"], row["status"]) for row in visit["participants"]] == [(code, "completed")]
    assert len(visit["rounds"]) == 3
    check_played(visit, participant, TICKS)
    check_answered(visit, participant)
    assert visit["events"]
    everything = "".join(file.read_text(encoding="utf-8") for file in (tmp_path / "out").iterdir())
    assert token not in everything


def test_a_reload_comes_back_to_the_same_round_and_a_second_tab_is_told(
    newcomer: Callable[[str], Participant], site: Site, tmp_path: Path
) -> None:
    participant = newcomer("reload")
    participant.begin(site.landing)
    while participant.stage != "round":
        participant.do_page()
    participant.presses.append([])
    cook = participant.start()
    participant.cook_until(cook, 10)

    participant.page.reload()
    participant.page.locator("#kitchen.drawn").wait_for()
    participant.shoot("back-after-reload")
    again = participant.watcher.last("keyframe")
    assert again is not None
    assert again["tick"] >= 10, [
        (frame["type"], frame.get("phase"), frame.get("tick")) for frame in participant.watcher.received
    ]
    participant.cook_until(participant.start(), 20)

    old = participant.page
    participant.page = old.context.new_page()
    participant.page.goto(old.url)
    participant.page.locator("#kitchen.drawn").wait_for()
    old.get_by_text("open in another tab").wait_for()
    old.bring_to_front()
    old.wait_for_timeout(SETTLE_MS)
    old.screenshot(path=participant.folder / "second-tab.png")
    old.keyboard.press("ArrowUp")
    participant.page.bring_to_front()
    cook = participant.start()
    participant.cook_until(cook, TICKS)
    participant.finish()
    old.close()
    code = participant.go_through()

    visit = newest_visit(site.export(tmp_path / "out"))
    assert [(row["completion_code"], row["status"]) for row in visit["participants"]] == [(code, "completed")]
    check_played(visit, participant, TICKS)
    assert [int(row["pauses"]) for row in visit["rounds"]] == [2, 0, 0]
