"""A real Chromium plays the whole demo study in real time, which takes ten minutes: for `make verify`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from galley.study.study import load_study
from galley.workspace import Workspace
from tests.browser.participant import Participant
from tests.browser.site import ROOT, Site, check_answered, check_played, newest_visit, open_site

pytestmark = [pytest.mark.full, pytest.mark.timeout(2400)]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with open_site(tmp_path_factory.mktemp("demo"), ROOT / "studies" / "demo.yaml") as opened:
        yield opened


def test_the_demo_from_landing_to_completion_code(
    newcomer: Callable[[str], Participant], site: Site, tmp_path: Path
) -> None:
    study = load_study(Workspace(ROOT), "demo")
    participant = newcomer("demo")
    participant.begin(site.landing)
    code = participant.go_through()
    assert code == study.config.completion.code

    visit = newest_visit(site.export(tmp_path / "out"))
    assert [(row["completion_code"], row["status"]) for row in visit["participants"]] == [(code, "completed")]
    assert [row["tutorial"] for row in visit["rounds"]] == ["true"] + ["false"] * 6
    check_played(visit, participant, 400)
    check_answered(visit, participant)
    assert all(int(row["score"]) > 0 for row in visit["rounds"] if row["layout"] == "cramped_room")
    assert [row["pauses"] for row in visit["rounds"]] == ["0"] * 7
