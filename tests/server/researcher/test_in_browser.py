"""The pages in a real Chromium: a replay by keyboard alone, a round watched as it grows, live numbers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from galley.records import TickRow
from tests.browser.conftest import browser as browser
from tests.browser.test_accessibility import ALL, COLOURS, barriers
from tests.server.researcher.office import NAME, PASSWORD, Office, open_office
from tests.server.researcher.pilot import Pilot


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory, office: Office) -> Iterator[Office]:
    """Pages of their own: what is changed in them is seen by no other module."""
    folder = tmp_path_factory.mktemp("browsed")
    with open_office(folder / "records.sqlite", office.workspace, office.study) as own:
        yield own


@pytest.fixture
def page(browser: Browser, office: Office) -> Iterator[Page]:
    """A researcher's browser; nothing may go wrong in it unseen."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    page.goto(f"{office.url}/researcher")
    # The first field takes the focus by itself, a moment after the page has loaded on a slow machine.
    page.locator("input[name=name]:focus").wait_for()
    page.keyboard.type(NAME)
    page.keyboard.press("Tab")
    page.keyboard.type(PASSWORD)
    page.keyboard.press("Enter")
    page.wait_for_selector("[data-page=studies]")
    yield page
    assert wrong == []
    context.close()


def tick(page: Page) -> int:
    return int(page.text_content("[data-part=tick]") or "-1")


def finished_round(office: Office) -> int:
    found = office.store.open_round(office.visits["done"].id, "rounds-1").result()
    assert found is not None
    return found.id


def open_replay(page: Page, office: Office, round_id: int) -> None:
    page.goto(f"{office.url}/researcher/rounds/{round_id}")
    page.wait_for_selector("#replay.drawn")


def test_a_replay_is_stepped_by_keys(page: Page, office: Office) -> None:
    open_replay(page, office, finished_round(office))
    assert tick(page) == 0
    for key, expected in (
        ("ArrowRight", 1),
        ("Shift+ArrowRight", 11),
        ("ArrowLeft", 10),
        ("Shift+ArrowLeft", 0),
        ("ArrowLeft", 0),
        ("End", 40),
        ("ArrowRight", 40),
        ("Home", 0),
    ):
        page.keyboard.press(key)
        assert tick(page) == expected, key
    assert "–" in (page.text_content("[data-part=action-0]") or "")
    page.keyboard.press("ArrowRight")
    words = (page.text_content("[data-part=action-0]") or "").split()
    assert words[1] in ("north", "south", "east", "west", "stay", "interact")


def test_space_plays_to_the_end_and_stops_there(page: Page, office: Office) -> None:
    open_replay(page, office, finished_round(office))
    page.select_option("[data-part=speed]", "8")
    page.locator("h1").click()
    page.keyboard.press("Space")
    page.wait_for_function("() => document.querySelector('[data-part=tick]').textContent === '40'")
    page.wait_for_function("() => document.querySelector('[data-do=play]').textContent.includes('Play')")


def test_every_tick_is_in_the_table_and_the_scrubber_leads_anywhere(page: Page, office: Office) -> None:
    open_replay(page, office, finished_round(office))
    page.locator("details.data summary").press("Enter")
    expect(page.locator("[data-part=table] tbody tr")).to_have_count(40)
    page.locator("[data-part=scrubber]").fill("23")
    assert tick(page) == 23
    assert page.locator("[data-part=lanes] rect").count() > 10


def test_going_back_shows_what_going_on_showed(page: Page, office: Office) -> None:
    open_replay(page, office, finished_round(office))
    chefs, score = "document.querySelector('.chefs tbody')", "document.querySelector('[data-part=score]')"
    shown = f"{chefs}.textContent + {score}.textContent"
    forward = []
    for _ in range(12):
        page.keyboard.press("ArrowRight")
        forward.append(page.evaluate(shown))
    back = [forward[-1]]
    for _ in range(11):
        page.keyboard.press("ArrowLeft")
        back.append(page.evaluate(shown))
    assert back[::-1] == forward


def test_a_round_is_watched_while_it_is_played(page: Page, office: Office) -> None:
    open_replay(page, office, office.open_round)
    before = tick(page)
    rows = [TickRow(before + n, 4, 4, 1000.0 * n, 0.5, 3.0, False) for n in range(6)]
    office.store.journal(office.open_round, rows)
    page.wait_for_function(f"() => document.querySelector('[data-part=tick]').textContent === '{before + 6}'")


def test_numbers_change_by_themselves(page: Page, office: Office) -> None:
    page.goto(f"{office.url}/researcher/studies/short")
    begun = page.locator(".numbers div", has_text="Begun").locator("dd")
    before = int(begun.inner_text())
    page.evaluate("window.same = true")
    Pilot(office.store, office.workspace, office.study, office.clock.ms()).begin()
    page.wait_for_function(
        "before => Number(document.querySelectorAll('.numbers dd')[1].textContent) === before + 1", arg=before
    )
    assert page.evaluate("window.same")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_barrier_on_any_page(browser: Browser, page: Page, office: Office, scheme: str) -> None:
    page.emulate_media(color_scheme=scheme)
    visit = office.visits["done"].id
    paths = ["", "/studies/short", "/studies/short/visits", "/studies/short/rounds", f"/visits/{visit}"]
    found = {}
    rules = ALL if scheme == "light" else COLOURS
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 900})
        for path in [*paths, f"/rounds/{finished_round(office)}"]:
            page.goto(f"{office.url}/researcher{path}")
            wide = page.evaluate(
                "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
            )
            if obstacles := barriers(page, rules):
                found[path, width] = obstacles
            assert wide <= 0, f"{path} is wider than {width} pixels"
    stranger = browser.new_page(color_scheme=scheme)
    stranger.goto(f"{office.url}/researcher/login")
    if obstacles := barriers(stranger, rules):
        found["/login", 1280] = obstacles
    stranger.close()
    assert not found, repr(found)
