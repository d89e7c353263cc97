"""The round's page alone in Chromium, with a server played by the test: keys, motion, cards, reconnecting."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.played import HOST, KEYFRAME, Server, tick
from tests.frontend.pages import render

PAGES: dict[str, Callable[[], str]] = {"/round": lambda: render("round.html", skippable=False, bonus=None)}


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1000, "height": 700})
    opened = context.new_page()
    faults: list[str] = []
    opened.on("pageerror", lambda error: faults.append(str(error)))
    opened.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    yield opened
    context.close()
    assert faults == []


@pytest.fixture
def server(page: Page) -> Server:
    played = Server(page, PAGES)
    page.goto(f"{HOST}/round")
    assert played.wait_for("hello")[0]["protocol"] == 2
    played.say(KEYFRAME)
    return played


def playing(server: Server, **changes: object) -> None:
    """Press Start and let the countdown pass."""
    expect(server.page.locator("[data-part=card-button]")).to_be_focused()
    server.page.keyboard.press("Enter")
    server.wait_for("ready")
    server.say({"type": "countdown", "seconds": 3}, KEYFRAME | {"phase": "playing"} | changes, tick(1))
    expect(server.page.locator("[data-part=over]")).to_be_hidden()


def test_a_press_is_sent_once_however_long_it_lasts(server: Server, page: Page) -> None:
    playing(server)
    for _ in range(3):
        page.keyboard.down("ArrowUp")  # the second and third are repeats
    page.keyboard.down("w")  # the same direction by another key
    page.keyboard.up("ArrowUp")
    page.keyboard.up("w")
    page.keyboard.press("Space")
    page.keyboard.press("Control+a")
    server.wait_for("key", 4)
    page.wait_for_timeout(50)
    assert server.keys() == [("up", True), ("up", False), ("interact", True), ("interact", False)]
    numbers = [message["seq"] for message in server.heard if "seq" in message]
    assert numbers == sorted(set(numbers))


KEY_EVENT = """([type, code, key, metaKey = false, repeat = false]) => {
  const event = new KeyboardEvent(type, {code, key, metaKey, repeat, bubbles: true, cancelable: true});
  (document.activeElement ?? document.body).dispatchEvent(event);
}"""


def send(page: Page, *event: object) -> None:
    """A keyboard event that no real keyboard of the test machine sends."""
    page.evaluate(KEY_EVENT, list(event))


def test_f2_a_click_leaves_no_focus_and_space_and_enter_cook(server: Server, page: Page) -> None:
    playing(server)
    sound = page.locator("[data-part=sound]")
    sound.click()
    assert sound.get_attribute("aria-pressed") == "true"
    assert page.evaluate("() => document.activeElement === document.body")
    for press in ("Space", "Enter"):
        page.keyboard.press(press)
    server.wait_for("key", 4)
    sound.focus()  # by the tabulator
    for press in ("Space", "Enter"):
        page.keyboard.press(press)
    server.wait_for("key", 8)
    assert server.keys() == [("interact", True), ("interact", False)] * 4
    assert sound.get_attribute("aria-pressed") == "true"


def test_f6_meta_lets_go_of_everything(server: Server, page: Page) -> None:
    playing(server)
    send(page, "keydown", "ArrowDown", "ArrowDown")
    send(page, "keydown", "MetaLeft", "Meta", True)
    assert server.wait_for("release")[0]["reason"] == "meta"
    send(page, "keyup", "MetaLeft", "Meta")
    send(page, "keydown", "ArrowDown", "ArrowDown")  # and it can be pressed again
    send(page, "keyup", "ArrowDown", "ArrowDown")
    server.wait_for("key", 3)
    assert server.keys() == [("down", True), ("down", True), ("down", False)]


def test_f6_a_held_key_that_stops_to_repeat_is_let_go(server: Server, page: Page) -> None:
    playing(server)
    send(page, "keydown", "KeyA", "a")
    page.wait_for_timeout(1200)  # keyboards that never repeat are believed
    assert server.keys() == [("left", True)]
    for _ in range(3):
        send(page, "keydown", "KeyA", "a", False, True)
    server.wait_for("key", 2)
    assert server.keys() == [("left", True), ("left", False)]
    send(page, "keydown", "KeyA", "a", False, True)  # they come again: it was held after all
    server.wait_for("key", 3)
    assert server.keys()[2:] == [("left", True)]


def test_f6_a_key_whose_repeats_another_key_took_over_stays_held(server: Server, page: Page) -> None:
    playing(server)
    send(page, "keydown", "ArrowUp", "ArrowUp")
    for _ in range(3):
        send(page, "keydown", "ArrowUp", "ArrowUp", False, True)
    send(page, "keydown", "Space", " ")
    send(page, "keyup", "Space", " ")
    page.wait_for_timeout(1200)
    assert server.keys() == [("up", True), ("interact", True), ("interact", False)]


@pytest.mark.parametrize(
    ("code", "key", "means"),
    [
        ("", "ArrowLeft", "left"),
        ("Numpad4", "ArrowLeft", "left"),
        ("Unidentified", "d", "right"),
        ("", "W", "up"),
        ("", " ", "interact"),
        ("KeyX", "w", None),
        ("KeyW", "z", "up"),
    ],
)
def test_f22_keys_without_a_place_count_by_their_meaning(
    server: Server, page: Page, code: str, key: str, means: str | None
) -> None:
    playing(server)
    send(page, "keydown", code, key)
    send(page, "keyup", code, key)
    send(page, "keydown", "ArrowDown", "ArrowDown")
    server.wait_for("key", 1 if means is None else 3)
    assert server.keys()[:-1] == ([] if means is None else [(means, True), (means, False)])


COVERED = """selector => [...document.querySelectorAll(selector)].filter(button => {
  const at = button.getBoundingClientRect();
  if (at.width === 0 || getComputedStyle(button).visibility === 'hidden') return false;
  return [[.5, .5], [.1, .5], [.9, .5], [.5, .1], [.5, .9]].some(([x, y]) => {
    const hit = document.elementFromPoint(at.left + x * at.width, at.top + y * at.height);
    return hit?.closest('button') !== button;
  });
}).map(button => button.outerHTML)"""
SCREENS = [(640, 360), (1280, 300), (844, 390), (320, 568), (568, 320), (390, 844), (1024, 600), (320, 256)]


SEEN = """button => {
  const at = button.getBoundingClientRect(), card = button.closest(".card").getBoundingClientRect();
  const low = document.elementFromPoint(at.x + at.width / 2, at.bottom - 4);
  return card.top <= at.top && at.bottom <= card.bottom && low?.closest("button") === button;
}"""


@pytest.mark.parametrize("touch", [True, False])
def test_f26_d16_nothing_covers_a_button_or_a_word_on_any_screen(browser: Browser, touch: bool) -> None:
    """A card's words and button (F26) and a round's buttons (D16), in a test visit's practice too."""
    context = browser.new_context(has_touch=touch, is_mobile=touch, reduced_motion="reduce")
    small = context.new_page()
    page = {"/round": lambda: render("round.html", skippable=True, test=True, round_no=None, bonus=None)}
    played = Server(small, page)
    small.goto(f"{HOST}/round")
    played.wait_for("hello")
    played.say(KEYFRAME)
    button = small.locator("[data-part=card-button]")
    expect(button).to_be_focused()
    for width, height in SCREENS:
        small.set_viewport_size({"width": width, "height": height})
        expect(button).to_be_in_viewport(ratio=1)
        assert button.evaluate(SEEN), (width, height)
        words, below = small.locator(".card-words").bounding_box(), button.bounding_box()
        assert words is not None
        assert below is not None
        assert words["y"] + words["height"] <= below["y"] + 0.5, (width, height)
        assert small.evaluate(COVERED, ".card button") == [], (width, height)
        if height > 300:  # so low a window only has to show the card
            hidden = "words => words.scrollHeight - words.clientHeight"
            assert small.locator(".card-words").evaluate(hidden) <= 1, (width, height)
    small.set_viewport_size({"width": 1024, "height": 600})
    button.click()
    played.wait_for("ready")
    played.say({"type": "countdown", "seconds": 3}, KEYFRAME | {"phase": "playing"}, tick(1))
    expect(small.locator("[data-part=over]")).to_be_hidden()
    for width, height in SCREENS:
        if height > 300:
            small.set_viewport_size({"width": width, "height": height})
            small.wait_for_timeout(100)  # the kitchen is drawn to its size
            assert small.evaluate(COVERED, ".round button") == [], (width, height)
    context.close()


def test_losing_the_keyboard_lets_go_of_everything(server: Server, page: Page) -> None:
    playing(server)
    page.keyboard.down("ArrowLeft")
    server.wait_for("key")
    page.evaluate("() => { window.dispatchEvent(new Event('blur')); }")
    assert server.wait_for("release")[0]["reason"] == "blur"
    page.keyboard.up("ArrowLeft")
    page.wait_for_timeout(50)
    assert server.keys() == [("left", True)]


def test_keys_do_nothing_before_the_start(server: Server, page: Page) -> None:
    expect(page.locator("[data-part=card-button]")).to_be_focused()
    page.keyboard.press("ArrowUp")
    page.wait_for_timeout(50)
    assert server.keys() == []


def test_score_time_and_hints_follow_the_round(server: Server, page: Page) -> None:
    playing(server)
    delivery = ["delivery", 0, "onion_soup", "serving", 3, 3]
    server.say(tick(200, score=40, events=[delivery]))
    expect(page.locator("[data-part=score]")).to_have_text("40")
    expect(page.locator("[data-part=time]")).to_have_text("0:30")
    assert "reached" in (page.locator("#kitchen").get_attribute("class") or "")
    hint = page.locator("[data-part=hint-move]")
    expect(hint).to_be_visible()
    page.keyboard.press("ArrowUp")
    expect(hint).to_be_hidden()


def test_what_moves_is_drawn_between_ticks(server: Server, page: Page) -> None:
    playing(server)
    look = "() => document.querySelector('canvas').toDataURL()"
    server.say(tick(20, chefs=[[2, 2, 2, 0], [3, 1, 0, 0]]))
    pictures = {page.evaluate(look) for _ in range(4)}
    assert len(pictures) > 1


def test_the_kitchen_is_sharp_on_a_dense_display(browser: Browser) -> None:
    context = browser.new_context(viewport={"width": 500, "height": 700}, device_scale_factor=3)
    server = Server(context.new_page(), PAGES)
    server.page.goto(f"{HOST}/round")
    server.wait_for("hello")
    server.say(KEYFRAME)
    expect(server.page.locator("canvas")).to_be_visible()
    server.page.wait_for_timeout(100)
    canvas = server.page.locator("canvas")
    inner = canvas.evaluate("drawn => drawn.width")
    outer = canvas.evaluate("drawn => drawn.getBoundingClientRect().width")
    assert inner == pytest.approx(3 * outer, abs=1)
    assert inner % len(KEYFRAME["grid"][0]) == 0  # every tile is a whole number of device pixels
    context.close()


def test_a_lost_socket_comes_back_and_the_round_goes_on(server: Server, page: Page) -> None:
    playing(server)
    server.sockets[-1].close(code=1012)
    expect(page.locator("[data-part=card-title]")).to_have_text("Connection lost")
    server.wait_for("hello", 2)
    tabs = {message["tab"] for message in server.heard if message["type"] == "hello"}
    assert len(tabs) == 1
    server.say(
        KEYFRAME | {"phase": "paused", "tick": 9}, {"type": "paused", "reason": "left", "seconds_left": 60}
    )
    expect(page.locator("[data-part=card-title]")).to_have_text("Paused")
    expect(page.locator("[data-part=card-button]")).to_be_focused()
    page.keyboard.press("Enter")
    server.wait_for("ready", 2)


def test_an_older_tab_says_so_and_stays_away(server: Server, page: Page) -> None:
    playing(server)
    server.say({"type": "elsewhere"})
    server.sockets[-1].close(code=4001)
    expect(page.locator("[data-part=card-title]")).to_contain_text("another tab")
    page.wait_for_timeout(900)
    assert len(server.sockets) == 1


def test_the_end_leads_on_but_not_by_a_key_still_pressed(server: Server, page: Page) -> None:
    playing(server)
    server.say(tick(400, score=20), {"type": "ended", "outcome": "finished", "score": 20, "next": "/v/token"})
    expect(page.locator("[data-part=card-text]")).to_have_text(
        "Soups served: 1. Points: 20. The goal was 40."
    )
    page.keyboard.press("Space")
    page.wait_for_timeout(100)
    assert page.url == f"{HOST}/round"
    expect(page.locator("[data-part=card-button]")).to_be_enabled()
    page.keyboard.press("Space")
    page.wait_for_url(f"{HOST}/v/token")


def open_round(page: Page, keyframe: dict[str, object], **values: object) -> Server:
    """A round's page with other settings than usual, at its first card."""
    pages: dict[str, Callable[[], str]] = {"/round": lambda: render("round.html", skippable=False, **values)}
    server = Server(page, pages)
    page.goto(f"{HOST}/round")
    server.wait_for("hello")
    server.say(KEYFRAME | keyframe)
    return server


def test_a_human_round_waits_for_both_and_says_when_the_other_is_away(page: Page) -> None:
    server = open_round(page, {"partner": "human"}, partner="human")
    expect(page.locator("[data-part=card-details]")).to_contain_text(
        "Another participant wears the orange hat."
    )
    page.locator("[data-part=card-button]").click()
    title = page.locator("[data-part=card-title]")
    expect(title).to_have_text("Waiting for the other participant …")
    server.say({"type": "countdown", "seconds": 3})
    expect(title).to_have_text("3")
    server.say(KEYFRAME | {"phase": "playing", "partner": "human"}, tick(1))
    server.say({"type": "paused", "reason": "partner", "seconds_left": 30})
    expect(title).to_have_text("Your partner's connection is lost")
    expect(page.locator("[data-part=card-button]")).to_be_hidden()
    server.say({"type": "ended", "outcome": "partner_left", "score": 0, "next": "/v/token"})
    expect(title).to_have_text("Your partner has left")


def test_games_of_a_round_are_counted_and_add_up(page: Page) -> None:
    server = open_round(page, {}, episodes=2, bonus={"amount": 0.5, "unit": "EUR"})
    playing(server, episodes=2)
    expect(page.locator("[data-part=episode]")).to_have_text("Game 1 of 2")
    server.say(
        tick(400, score=40), KEYFRAME | {"phase": "countdown", "episode": 2, "episodes": 2, "score": 40}
    )
    server.say({"type": "countdown", "seconds": 2})
    expect(page.locator("[data-part=card-text]")).to_have_text("Game 2 of 2")
    expect(page.locator("[data-part=episode]")).to_have_text("Game 2 of 2")
    expect(page.locator("[data-part=score]")).to_have_text("40")
    server.say(tick(400, score=60), {"type": "ended", "outcome": "finished", "score": 60, "next": "/v/token"})
    told = "Soups served: 3. Points: 60. You earned the bonus: 0.5 EUR."
    expect(page.locator("[data-part=card-text]")).to_have_text(told)


@pytest.mark.parametrize(
    ("shown", "told"),
    [("after", "Soups served: 2. Points: 20. The goal was 40."), ("never", "Go on when you are ready.")],
)
def test_a_score_is_told_when_it_may_be(page: Page, shown: str, told: str) -> None:
    server = open_round(page, {}, show_score=shown)
    playing(server, show_score=shown, points=10)
    delivery = ["delivery", 0, "onion_soup", "serving", 3, 3]
    server.say(tick(200, score=20, events=[delivery]))
    expect(page.locator("[data-part=time]")).to_have_text("0:30")
    assert "20" not in page.locator(".hud").inner_text()
    server.say({"type": "ended", "outcome": "finished", "score": 20, "next": "/v/token"})
    expect(page.locator("[data-part=card-text]")).to_have_text(told)


def test_whoever_cooks_alone_sees_one_cook(page: Page) -> None:
    server = open_round(page, {"partner": "none"}, partner="none", partner_hat=None)
    expect(page.locator("[data-part=card-details]")).to_contain_text("You cook alone")
    expect(page.locator("canvas")).to_be_visible()
    look = "() => document.querySelector('canvas').toDataURL()"
    page.emulate_media(reduced_motion="reduce")
    server.say(KEYFRAME | {"partner": "none", "phase": "playing", "tick": 300})
    page.wait_for_timeout(150)
    alone = page.evaluate(look)
    server.say(
        KEYFRAME | {"partner": "none", "phase": "playing", "tick": 300, "chefs": [[1, 2, 0, 0], [2, 1, 0, 0]]}
    )
    page.wait_for_timeout(150)
    assert page.evaluate(look) == alone


def test_the_round_speaks_chinese(page: Page) -> None:
    open_round(page, {}, language="zh")
    expect(page.locator("[data-part=card-button]")).to_have_text("开始")
