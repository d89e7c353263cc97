"""Keeps other sites' pages out, and tells browsers to load nothing from elsewhere."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from urllib.parse import urlsplit

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOG = logging.getLogger(__name__)

HEADERS: Mapping[str, str] = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
        "form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "x-frame-options": "DENY",
    "cross-origin-opener-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
}
DEFAULT_PORTS: Mapping[str, int] = {"http": 80, "https": 443}


def same_origin(headers: Mapping[str, str]) -> bool:
    """Whether a request came from a page of this server, or from no page at all.

    Browsers say it in Sec-Fetch-Site; where that is missing, Origin must name the host that was asked. A null
    origin alone tells nothing: with the referrer policy `no-referrer` browsers send it with our own forms.
    What it guards is little, for there are no cookies: a page without the link's token can do nothing in a
    participant's name.
    """
    site = headers.get("sec-fetch-site")
    origin = headers.get("origin")
    if site is not None:
        return site in ("same-origin", "none")
    return origin is None or origin == "null" or names_host(headers)


def names_host(headers: Mapping[str, str]) -> bool:
    """Whether Origin is the host that was asked, as Host or a proxy's X-Forwarded-Host tells it.

    A host without a port is compared by its name alone: some proxies drop the port.
    """
    asked = (headers.get("host", ""), headers.get("x-forwarded-host", "").split(",")[0].strip())
    try:
        origin = urlsplit(headers.get("origin", ""))
        port = origin.port or DEFAULT_PORTS.get(origin.scheme)
        hosts = [urlsplit(f"//{host}") for host in asked if host]
        return any(host.hostname == origin.hostname and host.port in (None, port) for host in hosts)
    except ValueError:
        return False


def tell_foreign(headers: Mapping[str, str]) -> None:
    """Log what a refused socket said: the page of another site, or a proxy that hides the name of ours."""
    LOG.warning(
        "a round's socket was refused: its page is of %.200r, but the host asked for is %.200r; "
        "if they are the same site, let the proxy pass on Host, see docs/scaling-out.md",
        headers.get("origin", ""),
        headers.get("host", ""),
    )


class SecureHeaders:
    """ASGI middleware that puts HEADERS on every response.

    The pages of `framed_by`, origins with spaces between, may show participants' pages in a frame, and get
    what is handed in; never the researchers' pages.
    """

    def __init__(self, app: ASGIApp, framed_by: str = "") -> None:
        self._app = app
        self._framed = dict(HEADERS)
        if framed_by:
            policy = HEADERS["content-security-policy"]
            policy = policy.replace("frame-ancestors 'none'", f"frame-ancestors {framed_by}")
            policy = policy.replace("form-action 'self'", f"form-action 'self' {framed_by}")
            self._framed["content-security-policy"] = policy
            del self._framed["x-frame-options"]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        researcher = scope["path"].startswith("/researcher")

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in (HEADERS if researcher else self._framed).items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_headers)
