"""Floods on one websocket (A4): frames without a message are paced too, and nothing is parsed at once."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import suppress

import httpx
import pytest
from websockets.frames import Frame, Opcode

from tests.server.helpers import ONE_ROUND, Participant, Served, serving
from tests.study.workspaces import study_workspace

HELLO = b'{"type": "hello", "protocol": 2, "tab": "a"}'


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("floods")
    with serving(study_workspace(folder / "lab", ONE_ROUND), folder / "records.sqlite") as server:
        yield server


def frame(opcode: Opcode, data: bytes = b"", *, fin: bool = True) -> bytes:
    return Frame(opcode, data, fin).serialize(mask=True)


def opened(served: Served) -> socket.socket:
    """A raw socket to a round, after the handshake."""
    person = Participant(served)
    person.agree()
    url = httpx.URL(served.url)
    line = socket.create_connection((url.host, url.port or 80), timeout=20)
    key = "dGhlIHNhbXBsZSBub25jZQ=="
    line.sendall(
        f"GET {person.path}/play HTTP/1.1\r\nHost: x\r\nConnection: upgrade\r\nUpgrade: websocket\r\n"
        f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode()
    )
    said = b""
    while b"\r\n\r\n" not in said:
        said += line.recv(4096)
    assert said.startswith(b"HTTP/1.1 101"), said
    return line


def latest_health_s(served: Served, until: threading.Event) -> float:
    """The longest that `/healthz` took until then."""
    worst = 0.0
    with httpx.Client() as http:
        while not until.is_set():
            began_s = time.monotonic()
            http.get(f"{served.url}/healthz")
            worst = max(worst, time.monotonic() - began_s)
            time.sleep(0.005)
    return worst


@pytest.mark.parametrize("opcode", [Opcode.PING, Opcode.PONG, Opcode.CONT])
def test_a4_frames_without_a_message_are_limited(served: Served, opcode: Opcode) -> None:
    """A flood of pings, pongs or empty parts of a message closes the connection with 1008."""
    with opened(served) as line:
        first = frame(Opcode.TEXT, b"x", fin=False) if opcode is Opcode.CONT else b""
        try:
            line.sendall(first + frame(opcode, fin=opcode is not Opcode.CONT) * 20_000)
            said = b""
            while more := line.recv(65536):
                said += more
        except ConnectionError:
            pass
        assert (1008).to_bytes(2, "big") in said


def test_a4_a_message_in_parts_is_still_read(served: Served) -> None:
    """A proxy may cut a message up, and a read may end anywhere."""
    with opened(served) as line:
        line.sendall(frame(Opcode.TEXT, HELLO[:9], fin=False))
        line.sendall(frame(Opcode.PING))
        whole = frame(Opcode.CONT, HELLO[9:])
        line.sendall(whole[:3])
        time.sleep(0.1)
        line.sendall(whole[3:])
        said = b""
        while b"keyframe" not in said:
            more = line.recv(65536)
            assert more
            said += more


def test_a4_a_message_longer_than_a_part_is_still_read(served: Served) -> None:
    """Nothing is lost of one that comes in hundreds of parts, nor of the one after it."""
    with opened(served) as line:
        line.sendall(frame(Opcode.TEXT, b"x" * 100_000) + frame(Opcode.TEXT, HELLO))
        said = b""
        while b"keyframe" not in said:
            more = line.recv(65536)
            assert more
            said += more
        assert b"refused" in said


def test_a4_ten_thousands_of_messages_at_once_hold_nobody_up(served: Served) -> None:
    """256 KiB of the smallest messages in one write: others are answered meanwhile."""
    done = threading.Event()
    worst: list[float] = []
    watching = threading.Thread(target=lambda: worst.append(latest_health_s(served, done)))
    lines = [opened(served) for _ in range(4)]
    watching.start()
    flood = frame(Opcode.TEXT, b"") * 40_000
    for line in lines:
        line.setblocking(False)
        with suppress(BlockingIOError):
            line.send(flood)
    time.sleep(1.5)
    done.set()
    watching.join()
    for line in lines:
        line.close()
    assert worst[0] < 0.25
