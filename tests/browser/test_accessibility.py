"""Nothing on any participant's page is a barrier that axe can find, in both themes, wide and narrow."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.browser.gallery import gallery, rendered
from tests.browser.played import HOST, KEYFRAME, Server

AXE = files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
WIDE, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
ALIKE = ("declined", "failed_checks", "timed_out", "expired", "partner_missing", "full", "later", "paused")
PAGES = sorted(set(gallery("en")) - {f"ending-{outcome}" for outcome in ALIKE})
READ = """async rules => (await axe.run({runOnly: rules})).violations.map(found => [
  found.id,
  found.nodes.map(node => [node.target.join(" "), node.any.concat(node.all).map(one => one.message)]),
])"""


def barriers(page: Page) -> list[Any]:
    """What axe finds on the page as it is now."""
    if not page.evaluate("() => 'axe' in window"):
        page.evaluate(AXE)
    found: list[Any] = page.evaluate(READ, RULES)
    return found


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    opened = browser.new_context(viewport=WIDE, reduced_motion="reduce")
    yield opened
    opened.close()


def visit(context: BrowserContext, name: str, language: str = "en") -> tuple[Page, Server]:
    """Open one page of the gallery; a round is brought to its first card."""
    page = context.new_page()
    server = Server(page, rendered(language))
    page.goto(f"{HOST}/{name}")
    if name == "round":
        server.wait_for("hello")
        server.say(KEYFRAME)
        expect(page.locator("#kitchen.drawn")).to_be_visible()
        expect(page.locator("[data-part=over]")).to_be_visible()
    return page, server


@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_no_barrier(context: BrowserContext, name: str, shots: Callable[[str], Path]) -> None:
    page, server = visit(context, name)
    folder = shots(f"pages/{name}")
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme=theme)
        for width, size in (("wide", WIDE), ("phone", PHONE)):
            page.set_viewport_size(size)
            assert barriers(page) == [], f"{theme} {width}"
            page.screenshot(path=folder / f"{theme}-{width}.png", full_page=True)
    if name == "round":
        server.say(KEYFRAME | {"phase": "playing"})
        expect(page.locator("[data-part=over]")).to_be_hidden()
        assert barriers(page) == []
