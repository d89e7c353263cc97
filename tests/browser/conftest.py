"""One Chromium for all browser tests, and people who come to a study with nothing but a keyboard."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright

from galley.agents.catalogue import Catalogue
from galley.workspace import Workspace
from tests.browser.participant import Participant
from tests.browser.site import ROOT, SECRET_NAMES, Site
from tests.browser.watching import Watcher


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """The system's Chromium; `make test` installs one where there is none.

    It goes with its module: as long as it is there an event loop is, and no other test may run its own.
    """
    found = subprocess.run(["sh", ROOT / "tests/chromium.sh"], capture_output=True, text=True, check=False)
    if found.returncode:
        pytest.fail(found.stderr)
    sandbox = os.geteuid() != 0  # Chromium refuses to run sandboxed as root
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(
            executable_path=found.stdout.strip(),
            chromium_sandbox=sandbox,
            args=[] if sandbox else ["--no-sandbox"],
        )
        yield started
        started.close()


@pytest.fixture(scope="session")
def shots() -> Callable[[str], Path]:
    """A fresh folder for the pictures of one visit, kept after the test for people to look at."""

    def folder(name: str) -> Path:
        place = ROOT / "tests" / "browser" / "screenshots" / name
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        return place

    return folder


@pytest.fixture
def newcomer(
    browser: Browser, site: Site, shots: Callable[[str], Path]
) -> Iterator[Callable[[str], Participant]]:
    """Someone new in a browser of their own; whatever they do, nothing may go wrong behind their back."""
    watchers = []
    brain = Catalogue(Workspace(ROOT)).bundle("myopic")

    def come(name: str) -> Participant:
        context = browser.new_context(viewport={"width": 1280, "height": 800})
        watchers.append((context, Watcher(context, site.url, tuple(SECRET_NAMES.values()))))
        return Participant(context, watchers[-1][1], brain.make(), shots(name))

    yield come
    for context, watcher in watchers:
        context.close()
        print("last messages:", watcher.received[-8:], watcher.sent[-8:])  # shown when a test fails
        assert watcher.errors == []
        assert watcher.other_hosts == set()
        assert watcher.leaks == []
        assert watcher.pages_read > 0
