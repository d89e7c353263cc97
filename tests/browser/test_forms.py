"""Questions in Chromium: by mouse, by keys, by touch, and without scripts, the form says the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import parse_qs

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.gallery import rendered
from tests.browser.played import HOST, Server

Open = Callable[..., Page]


@pytest.fixture
def opened(browser: Browser) -> Iterator[Open]:
    contexts = []
    faults: list[str] = []

    def visit(name: str, **options: Any) -> Page:
        context = browser.new_context(viewport={"width": 1000, "height": 800}, **options)
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("console", lambda told: faults.append(told.text) if told.type == "error" else None)
        Server(page, rendered("en"))
        page.goto(f"{HOST}/{name}")
        return page

    yield visit
    for context in contexts:
        context.close()
    assert faults == []


def sent(page: Page, press: Callable[[], None]) -> dict[str, list[str]]:
    """The fields of the form that a press sends."""
    with page.expect_request(lambda request: request.method == "POST") as caught:
        press()
    return parse_qs(caught.value.post_data or "")


def submitted(page: Page) -> dict[str, list[str]]:
    return sent(page, lambda: page.get_by_role("button", name="Continue").click())


def test_what_is_not_touched_is_not_sent(opened: Open) -> None:
    page = opened("questionnaire")
    expect(page.locator(".line-input")).to_be_visible()
    assert set(submitted(page)) == {"step"}


def test_the_word_of_the_chosen_point_is_seen_whole_on_a_phone(opened: Open) -> None:
    page = opened("questionnaire")
    page.set_viewport_size({"width": 360, "height": 740})
    points = page.locator(".worded .point input")
    assert points.count() == 5
    for number in range(5):
        points.nth(number).check(force=True)
        word = page.locator(".worded .point input:checked ~ .word")
        word.evaluate("word => { word.textContent = 'strongly prefer the second'; }")
        seen = word.evaluate(
            """word => {
              const box = word.closest(".scale-box"), at = word.getBoundingClientRect();
              const ends = [...box.querySelectorAll(".end")].map((end) => end.getBoundingClientRect().bottom);
              const inside = at.bottom <= box.getBoundingClientRect().bottom + 1;
              return inside && word.scrollHeight <= word.clientHeight + 1 && at.top >= Math.max(...ends) - 1;
            }"""
        )
        assert seen, number


def test_a_line_answers_by_a_press_in_its_middle(opened: Open) -> None:
    page = opened("questionnaire")
    page.locator(".line-input").click()
    assert submitted(page)["trust"] == ["50"]


def test_a_line_answers_by_keys_where_it_stands_or_beside(opened: Open) -> None:
    page = opened("questionnaire")
    line = page.locator(".line-input")
    expect(line).to_have_attribute("aria-valuetext", "not answered yet")
    line.focus()
    page.keyboard.press("Enter")
    assert page.locator("[name=trust]").input_value() == "50"
    page.keyboard.press("ArrowRight")
    expect(page.locator(".slider-told")).to_have_text("51 %")
    assert submitted(page)["trust"] == ["51"]


def test_an_order_is_given_by_pressing_and_changed_by_arrows_with_keys_alone(opened: Open) -> None:
    page = opened("questionnaire")
    page.get_by_role("button", name="Give it the next place: More time").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Give it the next place: More salt")).to_be_focused()
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Move up: More onions").focus()
    page.keyboard.press("Space")
    form = submitted(page)
    assert [form[f"ranks.{name}"] for name in ("time", "onion", "salt")] == [["1"], ["2"], ["3"]]


def test_an_order_is_changed_by_dragging(opened: Open) -> None:
    page = opened("questionnaire-problems")
    rows = page.locator(".rank-row")
    expect(rows.first).to_contain_text("More onions")
    rows.last.scroll_into_view_if_needed()
    first, last = rows.first.bounding_box(), rows.last.bounding_box()
    assert first is not None
    assert last is not None
    page.mouse.move(first["x"] + 120, first["y"] + first["height"] / 2)
    page.mouse.down()
    page.mouse.move(first["x"] + 120, last["y"] + last["height"] / 2, steps=8)
    page.mouse.up()
    form = submitted(page)
    assert [form[f"ranks.{name}"] for name in ("salt", "time", "onion")] == [["1"], ["2"], ["3"]]


def test_a_finger_slides_along_a_ruled_line(opened: Open) -> None:
    page = opened("questionnaire")
    page.locator(".scale-fine").scroll_into_view_if_needed()
    box = page.locator(".scale-fine").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 5, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] - 3, box["y"] + 20, steps=10)
    page.mouse.up()
    assert submitted(page)["effort"] == ["21"]


def test_answered_questions_are_counted(opened: Open) -> None:
    page = opened("questionnaire")
    told = page.locator(".answered span")
    expect(told).to_have_text("0 of 11 answered")
    page.locator("[name=fluent][value='3']").focus()
    page.keyboard.press("5")
    expect(told).to_have_text("1 of 11 answered")
    assert submitted(page)["fluent"] == ["5"]


def test_without_scripts_every_item_can_be_answered(opened: Open) -> None:
    page = opened("questionnaire", java_script_enabled=False)
    page.locator("[name=trust]").fill("70")
    for place, name in enumerate(("time", "salt", "onion"), start=1):
        page.locator(f"[name='ranks.{name}']").select_option(str(place))
    for name in ("fluent", "words", "stars", "poles"):
        page.locator(f"[name={name}][value='4']").check(force=True)
    page.locator("[name=effort][value='14']").focus()
    page.keyboard.press("Space")
    page.locator("[name=check][value=salt]").check()
    form = submitted(page)
    wanted = {"trust": "70", "ranks.time": "1", "ranks.salt": "2", "ranks.onion": "3", "effort": "14"}
    wanted |= {"fluent": "4", "words": "4", "stars": "4", "poles": "4", "check": "salt"}
    assert {name: form[name] for name in wanted} == {name: [value] for name, value in wanted.items()}


def test_values_given_before_are_there_again(opened: Open) -> None:
    form = submitted(opened("questionnaire-problems"))
    assert form["trust"] == ["70"]
    assert form["effort"] == ["14"]
    assert [form[f"ranks.{name}"] for name in ("onion", "salt", "time")] == [["1"], ["2"], ["3"]]


def test_a_break_holds_its_button_back_and_shows_the_time(opened: Open) -> None:
    page = opened("break")
    button = page.get_by_role("button", name="Go on")
    expect(button).to_have_attribute("aria-disabled", "true")
    expect(page.locator("#wait")).to_have_text("You can go on in 0:39.")
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.method))
    button.click(force=True)
    page.wait_for_timeout(100)
    assert asked == []


def test_a_break_without_scripts_leaves_the_time_to_the_server(opened: Open) -> None:
    page = opened("break", java_script_enabled=False)
    expect(page.locator("#wait")).to_have_text("You can go on in 40 seconds.")
    assert "step" in sent(page, lambda: page.get_by_role("button", name="Go on").click())


def test_when_the_time_is_up_the_form_goes_as_it_stands(opened: Open) -> None:
    page = opened("instructions")
    expect(page.locator(".limit")).to_contain_text("Time left for this page: 4:")
    page.evaluate(
        "() => { const real = performance.now.bind(performance); performance.now = () => real() + 4e5; }"
    )
    form = sent(page, lambda: None)
    assert form == {"step": ["instructions"], "time_up": ["1"]}
