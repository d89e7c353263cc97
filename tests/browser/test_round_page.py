"""The round's page alone in Chromium, with a server played by the test: keys, motion, cards, reconnecting."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, WebSocketRoute, expect

from tests.frontend.pages import FRONTEND, render

HOST = "http://galley.test"
TYPES = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
STRICT = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'"
KEYFRAME: dict[str, Any] = {
    "type": "keyframe",
    "phase": "waiting",
    "tick": 0,
    "horizon": 400,
    "tick_ms": 150,
    "seat": 0,
    "hats": ["blue", "orange"],
    "grid": ["XXPXX", "O   O", "X   X", "XDXSX"],
    "cook_time": 20,
    "chefs": [[1, 2, 0, 0], [3, 1, 0, 0]],
    "things": [],
    "pots": [[2, 0, 0, 0, 0, False]],
    "score": 0,
    "goal": 40,
    "round": 1,
    "of": 6,
    "tutorial": False,
    "orders": None,
}


def tick(number: int, **changes: Any) -> dict[str, Any]:
    """A tick message in which nothing happens but what is named."""
    still = {"chefs": KEYFRAME["chefs"], "things": [], "pots": [], "score": 0, "events": []}
    return {"type": "tick", "tick": number, **still, **changes}


class Server:
    """Answers the page's sockets and keeps what they say."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.sockets: list[WebSocketRoute] = []
        self.heard: list[dict[str, Any]] = []
        page.route_web_socket("**/v/token/play", self._accept)
        page.route(f"{HOST}/**", self._serve)

    def _accept(self, socket: WebSocketRoute) -> None:
        self.sockets.append(socket)
        socket.on_message(lambda text: self.heard.append(json.loads(text)))

    def _serve(self, route: Route) -> None:
        path = route.request.url.removeprefix(HOST)
        if path.startswith("/static/"):
            file = FRONTEND / path.removeprefix("/static/")
            route.fulfill(body=file.read_bytes(), content_type=TYPES[file.suffix])
        elif path == "/round":
            headers = {"content-security-policy": STRICT, "content-type": "text/html"}
            route.fulfill(body=render("round.html", skippable=False), headers=headers)
        else:
            route.fulfill(body=f"<h1>{path}</h1>", content_type="text/html")

    def say(self, *messages: dict[str, Any]) -> None:
        """Send messages on the newest socket."""
        for message in messages:
            self.sockets[-1].send(json.dumps(message))

    def wait_for(self, kind: str, many: int = 1) -> list[dict[str, Any]]:
        """Everything of a kind once there is so much of it; pings aside, the page says nothing unasked."""
        for _ in range(200):
            found = [message for message in self.heard if message["type"] == kind]
            if len(found) >= many:
                return found
            self.page.wait_for_timeout(25)
        raise AssertionError(f"no {many} of {kind} in {self.heard}")

    def keys(self) -> list[tuple[str, bool]]:
        """Key messages so far, as (key, down)."""
        return [(message["key"], message["down"]) for message in self.heard if message["type"] == "key"]


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
    played = Server(page)
    page.goto(f"{HOST}/round")
    assert played.wait_for("hello")[0]["protocol"] == 1
    played.say(KEYFRAME)
    return played


def playing(server: Server) -> None:
    """Press Start and let the countdown pass."""
    expect(server.page.locator("[data-part=card-button]")).to_be_focused()
    server.page.keyboard.press("Enter")
    server.wait_for("ready")
    server.say({"type": "countdown", "seconds": 3}, KEYFRAME | {"phase": "playing"}, tick(1))
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
    server = Server(context.new_page())
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
    expect(page.locator("[data-part=card-text]")).to_contain_text("1 soup: 20 points")
    page.keyboard.press("Space")
    page.wait_for_timeout(100)
    assert page.url == f"{HOST}/round"
    expect(page.locator("[data-part=card-button]")).to_be_enabled()
    page.keyboard.press("Space")
    page.wait_for_url(f"{HOST}/v/token")
