"""A slow line: a proxy that hands on every byte a fixed time later, both ways."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from urllib.parse import urlsplit

CHUNK_BYTES = 65536


@asynccontextmanager
async def delayed(url: str, delay_s: float) -> AsyncIterator[str]:
    """The URL of a server on this machine behind which is `url`, `delay_s` away in each direction.

    Order is kept and nothing is lost, as in TCP; the time to connect grows as well.
    """
    parts = urlsplit(url)
    tasks: set[asyncio.Task[None]] = set()

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        if task is not None:
            tasks.add(task)
        ends = [writer]
        try:
            await asyncio.sleep(delay_s)
            there_reader, there = await asyncio.open_connection(parts.hostname, parts.port or 80)
            ends.append(there)
            await asyncio.gather(_pipe(reader, there, delay_s), _pipe(there_reader, writer, delay_s))
        except OSError:
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


async def _pipe(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, delay_s: float) -> None:
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
