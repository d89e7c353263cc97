"""Nothing on any participant's page is a barrier that axe can find, in both themes, wide and narrow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
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
ALIKE = (
    "declined",
    "failed_checks",
    "timed_out",
    "expired",
    "partner_missing",
    "partner_lost",
    "full",
    "later",
    "paused",
)
PAGES = sorted(set(gallery("en")) - {f"ending-{outcome}" for outcome in ALIKE})
ALL = {"type": "tag", "values": RULES}
COLOURS = {"type": "rule", "values": ["color-contrast", "link-in-text-block"]}
"""What a theme decides; everything else is the same in both."""
READ = """async rules => (await axe.run({runOnly: rules})).violations.map(found => [
  found.id,
  found.nodes.map(node => [node.target.join(" "), node.any.concat(node.all).map(one => one.message)]),
])"""


def barriers(page: Page, rules: Mapping[str, Any] = ALL) -> list[Any]:
    """What axe finds on the page as it is now."""
    if not page.evaluate("() => 'axe' in window"):
        page.evaluate(AXE)
    found: list[Any] = page.evaluate(READ, rules)
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
            assert barriers(page, ALL if theme == "light" else COLOURS) == [], f"{theme} {width}"
            page.screenshot(path=folder / f"{theme}-{width}.png", full_page=True)
    if name == "round":
        server.say(KEYFRAME | {"phase": "playing"})
        expect(page.locator("[data-part=over]")).to_be_hidden()
        assert barriers(page) == []


PRESSED = """() => {
  const on = document.activeElement;
  const box = on.getBoundingClientRect();
  const leads = on.matches("main button, main a.button, main a[href^='/s/']");
  return [leads, box.width * box.height > 0, on.tagName];
}"""
FORMS = [name for name in PAGES if not name.startswith(("ending-c", "ending-i", "plain", "round"))]


@pytest.mark.parametrize("name", FORMS)
def test_keys_alone_lead_on(context: BrowserContext, name: str) -> None:
    page, _ = visit(context, name)
    for _ in range(80):
        page.keyboard.press("Tab")
        reached, seen, tag = page.evaluate(PRESSED)
        assert seen, f"{tag} has the focus but cannot be seen"
        if reached and page.evaluate("() => !document.activeElement.closest('.ranking')"):
            break
    else:
        pytest.fail("the keyboard does not reach the way on")
    outline = page.evaluate("() => getComputedStyle(document.activeElement).outlineStyle")
    assert outline == "solid"


@pytest.mark.parametrize("name", FORMS)
def test_pages_lead_on_without_scripts(browser: Browser, name: str) -> None:
    plain = browser.new_context(viewport=PHONE, java_script_enabled=False)
    page, _ = visit(plain, name)
    way_on = page.locator("main button[type=submit], main a.button, main a[href^='/s/']").first
    expect(way_on).to_be_visible()
    expect(way_on).to_be_enabled()
    wide = page.locator("main").bounding_box()
    assert wide is not None
    assert wide["x"] >= 0
    assert wide["x"] + wide["width"] <= PHONE["width"]
    plain.close()


def test_fingers_have_buttons_that_fit_and_work(browser: Browser) -> None:
    phone = browser.new_context(viewport={"width": 360, "height": 640}, has_touch=True, is_mobile=True)
    page, server = visit(phone, "round")
    page.locator("[data-part=card-button]").tap()
    server.say({"type": "countdown", "seconds": 1}, KEYFRAME | {"phase": "playing"})
    for name in ("Up", "Left", "Right", "Down", "Take / put"):
        button = page.get_by_role("button", name=name)
        box = button.bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 360
        assert min(box["width"], box["height"]) >= 44
        button.tap()
    server.wait_for("key", 10)
    presses = server.keys()
    assert [key for key, down in presses if down] == ["up", "left", "right", "down", "interact"]
    phone.close()
