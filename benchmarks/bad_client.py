"""One bad client beside twenty rounds of others: how late their ticks come.

    python benchmarks/bad_client.py            a table
    python benchmarks/bad_client.py --json     one JSON object a figure: name, value, unit, command

The client comes from one address and does all at once, as long as the rounds last: requests with headers of
1 kB to 200 MB, connections whose headers drip, 200 sockets of one visit that send messages without end, and
new visits as fast as they come. The limits are those of the settings' defaults. It must not make the 99th
percentile of the others' lateness 10 ms later than that of a bare timer.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import multiprocessing
import sys
import urllib.parse
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.live_rounds import LAYOUTS, Load, begin, play, study_text  # noqa: E402
from galley.workspace import Workspace  # noqa: E402

MOST_ABOVE_TIMER_MS = 10.0
OURS = "Host: x\r\nX-Forwarded-For: 203.0.113.66\r\n"
HANDSHAKE = (
    "Connection: upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
HEADER_BYTES = (1_000, 10_000, 100_000, 1_000_000, 20_000_000, 200_000_000)
SOCKETS = 200
KINDS = ["headers", "drip", "visits", "sockets"]
DRIPPING = 50
BEGINNING = 20


def attack(url: str, length_s: float, only: list[str]) -> None:
    """Do these kinds of it for so long."""
    path = begin(url, "mine")
    place = urllib.parse.urlsplit(url)

    async def connection() -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        return await asyncio.open_connection(place.hostname, place.port)

    async def headers(size: int) -> None:
        reader, writer = await connection()
        writer.write(b"GET / HTTP/1.1\r\nHost: x\r\nX-Large: ")
        for _ in range(max(1, size // 65536)):
            writer.write(b"a" * min(size, 65536))
            await writer.drain()
        writer.write(b"\r\n\r\n")
        await reader.read()

    async def drip() -> None:
        _, writer = await connection()
        while True:
            writer.write(b"X")
            await writer.drain()
            await asyncio.sleep(0.05)

    async def visits() -> None:
        request = f"POST /s/mine/begin HTTP/1.1\r\n{OURS}Content-Length: 0\r\n\r\n"
        reader, writer = await connection()
        while True:
            writer.write(request.encode())
            await reader.readuntil(b"\r\n\r\n")

    async def flood() -> None:
        reader, writer = await connection()
        writer.write(f"GET {path}/play HTTP/1.1\r\n{OURS}{HANDSHAKE}\r\n".encode())
        await reader.readuntil(b"\r\n\r\n")
        while True:
            writer.write((b"\x81\x82\0\0\0\0{}" + b"\x89\x80\0\0\0\0") * 20)
            await writer.drain()
            await asyncio.sleep(0.1)

    async def again(act) -> None:  # type: ignore[no-untyped-def]
        while True:
            with contextlib.suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
                await act()
            await asyncio.sleep(0.02)

    async def everything() -> None:
        kinds = {
            "headers": [lambda size=size: headers(size) for size in HEADER_BYTES],
            "drip": [drip] * DRIPPING,
            "visits": [visits] * BEGINNING,
            "sockets": [flood] * SOCKETS,
        }
        acts = [act for name in only for act in kinds[name]]
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(length_s):
                await asyncio.gather(*(again(act) for act in acts))

    asyncio.run(everything())


def main() -> int:
    """Print the figures; 1 if the others' rounds were too late."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--ticks", type=int, default=200, help="ticks of each round")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=KINDS, help="these kinds alone")
    parser.add_argument("--peace", action="store_true", help="the same without the bad client")
    options = parser.parse_args()
    load = Load(rounds=20, ticks=options.ticks, tick_ms=150, clients=1)

    def workspace(folder: Path, load: Load) -> list[str]:
        for part in ("layouts", "agents", "questionnaires"):
            (folder / part).symlink_to(ROOT / part)
        (folder / "studies").mkdir()
        (folder / "studies" / "mine.yaml").write_text(study_text(load, "myopic", LAYOUTS[0], 1))
        return Workspace(folder).names("studies")  # type: ignore[return-value]

    def watch(_pid: int, length_s: float, url: str) -> None:
        if not options.peace:
            context = multiprocessing.get_context("spawn")
            context.Process(target=attack, args=(url, length_s * 0.6, options.only), daemon=True).start()

    run = play(load, workspace, watch, limited=True)
    own, bare = run.lateness(99), run.control_lateness(99)
    command = f"python benchmarks/bad_client.py --ticks {options.ticks}{' --peace' * options.peace}"
    figures = [("others' lateness, 99th percentile", own), ("a bare timer's", bare), ("above it", own - bare)]
    for name, value in figures:
        line = {"name": name, "value": round(value, 2), "unit": "ms", "command": command}
        print(json.dumps(line) if options.json else f"{name:40}{value:8.2f} ms")
    for problem in run.problems:
        print(problem, file=sys.stderr)
    return int(own - bare > MOST_ABOVE_TIMER_MS)


if __name__ == "__main__":
    sys.exit(main())
