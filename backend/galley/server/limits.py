"""How much one visit or one address may ask for: paces, and what counts as one address."""

from __future__ import annotations

import asyncio
import ipaddress
from typing import Final

BURST_S: Final = 2.0
PREFIX_V6: Final = 64
"""Whoever has one IPv6 address has the 2^64 of its network as well."""


class Pace:
    """So many things a second, with `burst` of them at once (two seconds' worth if not told)."""

    def __init__(self, per_s: float, now_s: float, burst: float | None = None) -> None:
        self._per_s = per_s
        self._most = BURST_S * per_s if burst is None else burst
        self._left = self._most
        self._at_s = now_s

    def wait_s(self, now_s: float) -> float:
        """How long to wait before taking the next one, which is counted."""
        self._refill(now_s)
        self._left -= 1.0
        return max(0.0, -self._left / self._per_s)

    def refused_s(self, now_s: float) -> float:
        """As `wait_s`, but one that would have to wait is refused and not counted."""
        self._refill(now_s)
        if self._left < 1.0:
            return (1.0 - self._left) / self._per_s
        self._left -= 1.0
        return 0.0

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
