"""A line to a server on which everything that the server sends is kept."""

from __future__ import annotations

import asyncio
import threading
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

from galley.simulate.delay import delayed


@contextmanager
def recorded(url: str, delay_s: float = 0.0) -> Iterator[tuple[str, dict[int, bytearray]]]:
    """The URL of the line, and what came over it so far, by connection."""
    kept: dict[int, bytearray] = defaultdict(bytearray)
    ready, stop = threading.Event(), threading.Event()
    where: list[str] = []

    async def line() -> None:
        async with delayed(url, delay_s, lambda number, data: kept[number].extend(data)) as slow:
            where.append(slow)
            ready.set()
            await asyncio.to_thread(stop.wait)

    thread = threading.Thread(target=lambda: asyncio.run(line()))
    thread.start()
    try:
        assert ready.wait(20)
        yield where[0], kept
    finally:
        stop.set()
        thread.join()
