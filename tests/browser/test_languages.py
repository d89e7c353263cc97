"""Row D4 on the screen: longer and other words fit their pages, in a window and on a phone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.browser.gallery import rendered
from tests.browser.played import HOST, KEYFRAME, Server

SIZES = {"wide": {"width": 1280, "height": 720}, "phone": {"width": 360, "height": 640}}
PAGES = ("landing", "lobby", "questionnaire-problems", "comparison", "round")
WHOLLY = ("de", "ar")
"""The longest words, and the other direction; the others are tried where space is short."""
SPILT = """() => [...document.querySelectorAll("body *")].filter(one => {
  const box = one.getBoundingClientRect();
  if (!box.width || one.closest(".hidden, .skip, [hidden], canvas, .word, figcaption")) return false;
  const style = getComputedStyle(one);
  if (style.clipPath !== "none" || style.position === "absolute" && box.width <= 1) return false;
  const cut = style.overflowX !== "visible" && one.scrollWidth > one.clientWidth + 1;
  return cut || box.left < -1 || box.right > innerWidth + 1;
}).map(one => one.outerHTML.slice(0, 120))"""


FULL = [pytest.param(language, marks=pytest.mark.full) for language in ("fr", "es")]


@pytest.mark.parametrize("language", ["de", "ja", "ar", *FULL])
def test_d4_pages_hold_their_words(browser: Browser, language: str, shots: Callable[[str], Path]) -> None:
    """Arabic has no catalogue: its pages show that the layout turns round and nothing leaves the window."""
    context = browser.new_context(reduced_motion="reduce")
    folder = shots(f"languages/{language}")
    for name in PAGES if language in WHOLLY else PAGES[-2:]:
        page = context.new_page()
        server = Server(page, rendered(language))
        for size, viewport in SIZES.items():
            page.set_viewport_size(viewport)
            page.goto(f"{HOST}/{name}")
            if name == "round":
                server.wait_for("hello")
                server.say(KEYFRAME)
                expect(page.locator("[data-part=over]")).to_be_visible()
                page.screenshot(path=folder / f"{name}-card-{size}.png")
                assert page.evaluate(SPILT) == [], f"{name} card {size}"
                server.say(KEYFRAME | {"phase": "playing"})
                expect(page.locator("[data-part=over]")).to_be_hidden()
            page.screenshot(path=folder / f"{name}-{size}.png", full_page=True)
            assert page.evaluate(SPILT) == [], f"{name} {size}"
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        page.close()
    context.close()
