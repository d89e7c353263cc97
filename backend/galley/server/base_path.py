"""The sub-path at which a proxy offers the site, such as /kitchen: taken off what comes, put on what goes.

Everything inside knows paths of the site alone. What leaves it, in pages, redirects, cookies and links to
copy, gets the base path here.
"""

from __future__ import annotations

import re
from contextvars import ContextVar
from typing import Any, Final

import jinja2
from jinja2.ext import Extension
from markupsafe import Markup
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from galley.errors import GalleyError

HEADER: Final = "x-forwarded-prefix"
PATH: Final = re.compile(r"(/[A-Za-z0-9_~-][A-Za-z0-9._~-]*)+")
OWN: Final = ("s", "v", "static", "pictures", "researcher", "healthz")
ATTRIBUTES: Final = (
    "href|src|action|data-socket|data-next|data-sprites|data-poll|data-away|data-url|data-live"
)
LITERAL: Final = re.compile(rf'\b({ATTRIBUTES})="(?=/(?!/))')
EXPRESSION: Final = re.compile(rf'\b({ATTRIBUTES})="\{{\{{-?\s*(.+?)\s*-?\}}\}}')

_BASE: ContextVar[str] = ContextVar("base_path", default="")


def at(path: Any) -> Any:
    """A path of the site as browsers ask for it; whole URLs and places in a page stay as they are."""
    text = str(path)
    return f"{_BASE.get()}{text}" if text.startswith("/") and not text.startswith("//") else path


def _prose(html: str) -> Markup:
    """The HTML of a text, whose pictures of its own are paths of the site."""
    return Markup(html.replace(' src="/pictures/', f' src="{_BASE.get()}/pictures/'))  # noqa: S704 - made by us


def site(request: Request) -> str:
    """The URL at which a browser found the site, without a slash at its end."""
    return str(request.base_url).rstrip("/") + _BASE.get()


def checked(value: str) -> str:
    """A base path as the setting has it, without a slash at its end.

    Raises:
        GalleyError: it is no path, or it begins as one of the site's own.
    """
    path = value.rstrip("/")
    if path and (not PATH.fullmatch(path) or path.split("/")[1] in OWN):
        raise GalleyError(
            f"BASE_PATH: '{value}' is not possible; write a path such as /kitchen, of letters, digits "
            f"and . _ ~ -, that does not begin with /{', /'.join(OWN)}"
        )
    return path


class Paths(Extension):
    """Lets templates write paths of the site: the attributes that hold them get the base path."""

    def __init__(self, environment: jinja2.Environment) -> None:
        super().__init__(environment)
        environment.filters["at"] = at
        environment.filters["prose"] = _prose
        environment.globals["base_path"] = _BASE.get

    def preprocess(self, source: str, name: str | None, filename: str | None = None) -> str:
        """The template with `at` around what its attributes say."""
        del name, filename
        source = EXPRESSION.sub(r'\1="{{ (\2) | at }}', source)
        return LITERAL.sub(r"""\1="{{ base_path() }}""", source)


class BasePath:
    """ASGI middleware for a site at a sub-path: the setting's, else the one that a proxy tells in HEADER.

    With the setting the proxy may take the base path off or leave it; who tells it in HEADER has taken it
    off.
    """

    def __init__(self, app: ASGIApp, base: str) -> None:
        self._app = app
        self._base = base

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or socket."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        base = self._base
        if base and (scope["path"] == base or scope["path"].startswith(f"{base}/")):
            path = scope["path"].removeprefix(base) or "/"
            scope = {**scope, "path": path, "raw_path": path.encode()}
        elif not base:
            told = Headers(scope=scope).get(HEADER, "").split(",")[0].strip().rstrip("/")
            base = told if PATH.fullmatch(told) else ""
        _BASE.set(base)
        here = str(Request({**scope, "type": "http"}).base_url) if scope["type"] == "http" else ""

        async def send_with_base(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if "location" in headers:
                    # Redirects to the same path without its last slash name the whole site, by a Host that
                    # a proxy may have changed.
                    location = headers["location"]
                    headers["location"] = at(
                        f"/{location[len(here) :]}" if location.startswith(here) else location
                    )
                message["headers"] = [
                    (name, _cookie(value, base) if base and name == b"set-cookie" else value)
                    for name, value in message["headers"]
                ]
            await send(message)

        await self._app(scope, receive, send_with_base)


def _cookie(value: bytes, base: str) -> bytes:
    """A cookie of the site with its path below the base path."""
    return re.sub(rb"(;\s*path=)/", rb"\1" + base.encode() + b"/", value, flags=re.IGNORECASE)
