"""A slow line: a proxy that hands on every byte a fixed time later, both ways."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from urllib.parse import urlsplit

CHUNK_BYTES = 65536

Heard = Callable[[int, bytes], None]
"""Is given the number of a connection and the bytes that the server sent on it."""


@asynccontextmanager
async def delayed(url: str, delay_s: float, heard: Heard | None = None) -> AsyncIterator[str]:
    """The URL of a server on this machine behind which is `url`, `delay_s` away in each direction.

    Order is kept and nothing is lost, as in TCP; the time to connect grows as well. `heard` gets a copy of
    everything that the server sends.
    """
    parts = urlsplit(url)
    tasks: set[asyncio.Task[None]] = set()
    numbers = itertools.count()

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        if task is not None:
            tasks.add(task)
        ends = [writer]
        number = next(numbers)

        def copy(data: bytes) -> None:
            if heard is not None:
                heard(number, data)

        try:
            await asyncio.sleep(delay_s)
            there_reader, there = await asyncio.open_connection(parts.hostname, parts.port or 80)
            ends.append(there)
            ways = [_pipe(reader, there, delay_s), _pipe(there_reader, writer, delay_s, copy)]
            await asyncio.gather(*ways)
        except (OSError, asyncio.CancelledError):
            # Cancelled below, when the line is taken down: asyncio's streams would log that as an error.
            return
        finally:
            for end in ends:
                end.close()
            if task is not None:
                tasks.discard(task)

    server = await asyncio.start_server(connected, "127.0.0.1", 0)
    try:
        yield f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}"
    finally:
        server.close()
        left = list(tasks)
        for task in left:
            task.cancel()
        await asyncio.gather(*left, return_exceptions=True)


async def _pipe(
    reader: asyncio.StreamReader,
    writer: asyncio.StreamWriter,
    delay_s: float,
    copy: Callable[[bytes], None] | None = None,
) -> None:
    """Hand on what comes, each piece `delay_s` after it came, then the end."""
    loop = asyncio.get_running_loop()
    waiting: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

    async def read() -> None:
        data = b"."
        while data:
            try:
                data = await reader.read(CHUNK_BYTES)
            except OSError:
                data = b""
            if copy is not None:
                copy(data)
            waiting.put_nowait((loop.time() + delay_s, data))

    reading = asyncio.create_task(read())
    try:
        while True:
            due_s, data = await waiting.get()
            await asyncio.sleep(due_s - loop.time())
            if not data:
                writer.write_eof()
                return
            writer.write(data)
            await writer.drain()
    except OSError:
        return
    finally:
        reading.cancel()
        with suppress(asyncio.CancelledError):
            await reading
