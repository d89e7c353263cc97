"""A reload in the middle of a round comes back to it, and of two tabs the newer one plays."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.browser.participant import SETTLE_MS, Participant
from tests.browser.site import ROOT, Site, check_played, newest_visit, open_site

TICKS = 200  # long enough for a page to be loaded in the middle, on a busy machine too


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    study = ROOT / "tests" / "workspaces" / "short" / "studies" / "short.yaml"
    changes = {"horizon_ticks: 40": f"horizon_ticks: {TICKS}", "abandon_after_s: 5": "abandon_after_s: 60"}
    with open_site(tmp_path_factory.mktemp("short"), study, changes) as opened:
        yield opened


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
    assert 10 <= again["tick"] < TICKS
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
    assert participant.stage == "round", "the next round, not the one that is over"

    visit = newest_visit(site.export(tmp_path / "out"))
    visit["rounds"] = [row for row in visit["rounds"] if row["status"] != "open"]
    check_played(visit, participant, TICKS)
    assert [int(row["pauses"]) for row in visit["rounds"]] == [2]
