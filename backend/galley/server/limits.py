"""How much one visit or one address may ask for: paces, and what counts as one address."""

from __future__ import annotations

import asyncio
import ipaddress
from typing import Final

from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send

BURST_S: Final = 2.0
PREFIX_V6: Final = 64
"""Whoever has one IPv6 address has the 2^64 of its network as well."""

MOST_KEPT: Final = 10_000
LONGEST_QUEUE_S: Final = 10.0
REFUSED_AFTER_S: Final = 1.0
"""How late a refusal comes, so that those who ask again at once do not ask more often."""


class Pace:
    """So many things a second, with `burst` of them at once (two seconds' worth if not told)."""

    def __init__(self, per_s: float, now_s: float, burst: float | None = None) -> None:
        self._per_s = per_s
        self._most = BURST_S * per_s if burst is None else burst
        self._left = self._most
        self._at_s = now_s

    def wait_s(self, now_s: float, patience_s: float = float("inf")) -> float:
        """How long to wait before taking the next one; it is counted unless that is beyond the patience."""
        self._refill(now_s)
        wait_s = max(0.0, (1.0 - self._left) / self._per_s)
        if wait_s <= patience_s:
            self._left -= 1.0
        return wait_s

    def full(self, now_s: float) -> bool:
        """Whether nothing was taken lately, so that a new one would be the same."""
        self._refill(now_s)
        return self._left >= self._most

    async def wait(self) -> None:
        """Return when the next one may be taken."""
        if wait_s := self.wait_s(asyncio.get_running_loop().time()):
            await asyncio.sleep(wait_s)

    def _refill(self, now_s: float) -> None:
        self._left = min(self._most, self._left + (now_s - self._at_s) * self._per_s)
        self._at_s = now_s


def network_of(host: str) -> str:
    """The address that a limit counts by: IPv4 as it is, IPv6 by its /64; "" for what is no address."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return ""
    if isinstance(address, ipaddress.IPv4Address):
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(ipaddress.ip_network((address, PREFIX_V6), strict=False))


class Paces:
    """A pace for each key, forgotten once it stands still. A flood of new keys shares one pace at last."""

    def __init__(self, per_s: float, burst: float | None = None) -> None:
        self._per_s = per_s
        self._burst = burst
        self._kept: dict[str, Pace] = {}

    def of(self, key: str, now_s: float) -> Pace:
        """The pace of a key; "" is for everybody who finds no room."""
        found = self._kept.get(key)
        if found is None:
            if len(self._kept) >= MOST_KEPT:
                self._kept = {name: pace for name, pace in self._kept.items() if not pace.full(now_s)}
            if len(self._kept) >= MOST_KEPT:
                key = ""
            found = self._kept.setdefault(key, Pace(self._per_s, now_s, self._burst))
        return found


class PerAddress:
    """ASGI middleware that lets the requests of one address wait their turn, and refuses endless queues.

    Requests that wait are spread evenly, so that a hundred at once do not hold up what else is going on.
    Health checks do not wait.
    """

    def __init__(self, app: ASGIApp, per_s: float) -> None:
        self._app = app
        self._paces = Paces(per_s, burst=max(1.0, per_s / 10.0))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or socket."""
        if scope["type"] in ("http", "websocket") and scope["path"] != "/healthz":
            key = network_of((scope.get("client") or ("",))[0])
            now_s = asyncio.get_running_loop().time()
            if key:
                wait_s = self._paces.of(key, now_s).wait_s(now_s, LONGEST_QUEUE_S)
                if wait_s > LONGEST_QUEUE_S:
                    headers = {"retry-after": str(round(wait_s) + 1)}
                    refusal = PlainTextResponse("Too many requests; wait a moment.", 429, headers)
                    await asyncio.sleep(REFUSED_AFTER_S)
                    await refusal(scope, receive, send)
                    return
                if wait_s > 0:
                    await asyncio.sleep(wait_s)
        await self._app(scope, receive, send)
