"""A server played by a test: the real pages and files under the real content policy, sockets by hand."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Page, Route, WebSocketRoute

from tests.frontend.pages import FRONTEND

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
    "points": 20,
    "episode": 1,
    "episodes": 1,
    "show_score": "during",
    "input_mode": "hold",
    "partner": "agent",
}


def tick(number: int, **changes: Any) -> dict[str, Any]:
    """A tick message in which nothing happens but what is named."""
    still = {"chefs": KEYFRAME["chefs"], "things": [], "pots": [], "score": 0, "events": []}
    return {"type": "tick", "tick": number, **still, **changes}


class Server:
    """Answers a page's requests with `pages` by path, and its sockets; keeps what they say."""

    def __init__(self, page: Page, pages: dict[str, Callable[[], str]]) -> None:
        self.page = page
        self.pages = pages
        self.sockets: list[WebSocketRoute] = []
        self.heard: list[dict[str, Any]] = []
        page.route_web_socket("**/v/token/play", self._accept)
        page.route(f"{HOST}/**", self._serve)

    def _accept(self, socket: WebSocketRoute) -> None:
        self.sockets.append(socket)
        socket.on_message(lambda text: self.heard.append(json.loads(text)))

    def _serve(self, route: Route) -> None:
        path = route.request.url.removeprefix(HOST).partition("?")[0]
        if path.startswith("/static/"):
            file = FRONTEND / path.removeprefix("/static/")
            route.fulfill(body=file.read_bytes(), content_type=TYPES[file.suffix])
        elif path in self.pages:
            headers = {"content-security-policy": STRICT, "content-type": "text/html; charset=utf-8"}
            route.fulfill(body=self.pages[path](), headers=headers)
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
