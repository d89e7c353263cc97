"""The slow line hands on every byte in order, no sooner than it should."""

from __future__ import annotations

import asyncio
import os

from galley.simulate.delay import delayed

DELAY_S = 0.15


def test_bytes_come_whole_and_late() -> None:
    content = os.urandom(300_000)

    async def echo(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(65536):
            writer.write(data)
            await writer.drain()
        writer.close()

    async def there_and_back() -> tuple[bytes, float]:
        server = await asyncio.start_server(echo, "127.0.0.1", 0)
        url = f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        async with server, delayed(url, DELAY_S) as slow:
            reader, writer = await asyncio.open_connection("127.0.0.1", int(slow.rsplit(":", 1)[1]))
            loop = asyncio.get_running_loop()
            began_s = loop.time()
            writer.write(content)
            writer.write_eof()
            first = await reader.read(1)
            took_s = loop.time() - began_s
            rest = await reader.read()
            writer.close()
            return first + rest, took_s

    received, took_s = asyncio.run(there_and_back())
    assert received == content
    assert took_s >= 2 * DELAY_S
