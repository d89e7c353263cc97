"""A real Chromium plays a whole short study against a real server, by keyboard; its records are opened."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.browser.participant import Participant
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
