"""Every route of the application, each classed by who may use it; a route without a class fails the tests."""

from __future__ import annotations

from collections.abc import Iterator

from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute

OPEN = "open"
"""Anybody may ask for it."""
TOKEN = "token"  # the word names a class of routes, no secret
"""Whoever has the link of a visit, and only for that visit."""
RESEARCHER = "researcher"
"""Whoever is logged in."""

CLASSES: dict[str, str] = {
    "GET /": OPEN,
    "HEAD /": OPEN,
    "GET /healthz": OPEN,
    "HEAD /healthz": OPEN,
    "GET /s/{study}": OPEN,
    "HEAD /s/{study}": OPEN,
    "GET /s/{study}/begin": OPEN,
    "HEAD /s/{study}/begin": OPEN,
    "POST /s/{study}/begin": OPEN,
    "GET /pictures/{name}": OPEN,
    "HEAD /pictures/{name}": OPEN,
    "MOUNT /static": OPEN,
    "GET /v/{token}": TOKEN,
    "HEAD /v/{token}": TOKEN,
    "POST /v/{token}": TOKEN,
    "POST /v/{token}/away": TOKEN,
    "GET /v/{token}/play": TOKEN,
    "HEAD /v/{token}/play": TOKEN,
    "GET /v/{token}/lobby": TOKEN,
    "HEAD /v/{token}/lobby": TOKEN,
    "SOCKET /v/{token}/play": TOKEN,
    "GET /researcher/login": OPEN,
    "HEAD /researcher/login": OPEN,
    "POST /researcher/login": OPEN,
}
"""Of every route but those under /researcher, which are all RESEARCHER unless they stand here."""


def all_routes(routes: list[BaseRoute]) -> Iterator[tuple[str, str]]:
    """(method, path) of every route; sockets have the method SOCKET, folders MOUNT."""
    for route in routes:
        if isinstance(route, WebSocketRoute):
            yield "SOCKET", route.path
        elif isinstance(route, Route):
            for method in sorted(route.methods or ()):
                yield method, route.path
        elif isinstance(route, Mount):
            yield "MOUNT", route.path
        else:
            raise AssertionError(f"a route of a kind that is not walked: {route!r}")


def class_of(method: str, path: str) -> str | None:
    """Who may use a route; None when nobody has said so yet."""
    known = CLASSES.get(f"{method} {path}")
    if known is None and path.startswith("/researcher"):
        return RESEARCHER
    return known
