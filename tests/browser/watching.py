"""What a page did unseen: errors, hosts asked, names that leaked, the frames of its socket."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Sequence
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import BrowserContext, ConsoleMessage, Page, Response, WebSocket

CSP_TO_CONSOLE = """
addEventListener("securitypolicyviolation", (event) =>
  console.error(`refused by the security policy: ${event.violatedDirective} ${event.blockedURI}`));
"""


class Watcher:
    """Listens to every page of a browser context, from before the first request."""

    def __init__(self, context: BrowserContext, url: str, secrets: Sequence[str]) -> None:
        self._secret = re.compile("|".join(map(re.escape, secrets)), re.IGNORECASE)
        self._host = urlsplit(url).netloc
        self.errors: list[str] = []
        self.other_hosts: set[str] = set()
        self.leaks: list[str] = []
        self.received: list[dict[str, Any]] = []
        self.sent: list[dict[str, Any]] = []
        self.pages_read = 0
        self._heard_at = time.monotonic()
        context.add_init_script(CSP_TO_CONSOLE)
        context.on("page", self._watch)

    def _watch(self, page: Page) -> None:
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("request", lambda request: self._asked(request.url))
        page.on("response", self._answered)
        page.on("websocket", self._opened)

    def _heard(self, message: ConsoleMessage) -> None:
        harmless = "the round is ended" in message.text  # a key that was on its way when time was up
        if message.type in ("error", "warning") and not harmless:
            self.errors.append(f"{message.type}: {message.text} ({message.location['url']})")

    def _asked(self, url: str) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("data", "blob") and parts.netloc != self._host:
            self.other_hosts.add(parts.netloc)

    def _answered(self, response: Response) -> None:
        self._search(response.url, json.dumps(response.headers))
        if response.status >= 400:
            self.errors.append(f"{response.status} {response.url}")

    def _opened(self, socket: WebSocket) -> None:
        self._asked(socket.url)
        socket.on("framereceived", lambda frame: self._framed(self.received, frame))
        socket.on("framesent", lambda frame: self._framed(self.sent, frame))

    def _framed(self, frames: list[dict[str, Any]], frame: str | bytes) -> None:
        text = frame if isinstance(frame, str) else frame.decode()
        self._search("websocket", text)
        frames.append(json.loads(text))
        self._heard_at = time.monotonic()

    def _search(self, where: str, text: str) -> None:
        self.leaks += [f"{where}: {found}" for found in self._secret.findall(text)]

    def read(self, page: Page) -> None:
        """Search the page as it is now, in full, for what participants must not learn."""
        self.pages_read += 1
        self._search(page.url, page.content())

    def alive(self, silence_s: float = 30) -> bool:
        """Whether a frame came lately; a stop for a test that would wait for ever."""
        return time.monotonic() - self._heard_at < silence_s

    def last(self, kind: str) -> dict[str, Any] | None:
        """The newest message of this type from the server."""
        return next((frame for frame in reversed(self.received) if frame["type"] == kind), None)
