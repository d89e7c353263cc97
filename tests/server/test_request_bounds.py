"""Requests that are too large or too slow (A2, A17), sent straight to the server, as without a proxy."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Iterator

import httpx
import pytest

from galley.server import request_bounds
from tests.server.helpers import ONE_ROUND, Served, serving
from tests.study.workspaces import study_workspace

MIB = 1024 * 1024
HANDSHAKE = (
    b"GET /v/none/play HTTP/1.1\r\nHost: x\r\nConnection: upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
CHUNKED = b"POST /s/mine/begin HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A server whose patience is short."""
    folder = tmp_path_factory.mktemp("bounds")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("HEAD_WITHIN_S", "BODY_WITHIN_S", "LINGER_S"):
            patch.setattr(request_bounds, name, 1.0)
        with serving(study_workspace(folder / "lab", ONE_ROUND), folder / "records.sqlite") as server:
            yield server


def connected(served: Served) -> socket.socket:
    url = httpx.URL(served.url)
    return socket.create_connection((url.host, url.port or 80), timeout=20)


def answer_to(served: Served, *parts: bytes, pause_s: float = 0.0) -> bytes:
    """What the server says to these bytes until it closes the connection."""
    with connected(served) as line:
        for part in parts:
            try:
                line.sendall(part)
            except OSError:
                break
            time.sleep(pause_s)
        return until_closed(line)


def until_closed(line: socket.socket) -> bytes:
    said = b""
    try:
        while more := line.recv(65536):
            said += more
    except ConnectionError:
        pass
    return said


def status(said: bytes) -> int:
    return int(said.split(b" ")[1]) if said else 0


SIZES = (70_000, 200_000, MIB, 60 * MIB)
PLACES = [(where, size) for where in ("header", "name", "url", "many", "handshake") for size in SIZES]
PLACES += [("trailer", size) for size in SIZES if size > 300_000]
"""A trailer that comes with the end of the body in one read is not kept apart from it."""


@pytest.mark.parametrize(("where", "size"), PLACES)
def test_a2_a_head_beyond_64_kib_is_refused(served: Served, size: int, where: str) -> None:
    """431 wherever the bytes stand, within a second, while others are answered."""
    large = b"a" * size
    heads = {
        "header": b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-Large: " + large + b"\r\n\r\n",
        "name": b"GET /healthz HTTP/1.1\r\nHost: x\r\n" + large + b": 1\r\n\r\n",
        "url": b"GET /healthz?" + large + b" HTTP/1.1\r\nHost: x\r\n\r\n",
        "many": b"GET /healthz HTTP/1.1\r\nHost: x\r\n" + b"X-Y: z\r\n" * (size // 8) + b"\r\n",
        "handshake": HANDSHAKE + b"X: " + large + b"\r\n\r\n",
        "trailer": CHUNKED + b"1\r\na\r\n0\r\nX-Large: " + large + b"\r\n\r\n",
    }
    began_s = time.monotonic()
    said = answer_to(served, heads[where])
    assert status(said) == 431, said[:100]
    assert time.monotonic() - began_s < 10
    assert httpx.get(f"{served.url}/healthz").status_code == 200


def test_a2_what_browsers_send_is_served(served: Served) -> None:
    """A head of 60 kB with hundreds of cookies is within the bound."""
    headers = {f"X-{number}": "v" * 60 for number in range(900)}
    assert httpx.get(f"{served.url}/healthz", headers=headers).status_code == 200


def test_a2_headers_too_large_for_a_websocket_get_an_answer(served: Served) -> None:
    """The websocket library has bounds of its own (8 kB a line, 128 headers): a 4xx, no traceback."""
    said = answer_to(served, HANDSHAKE + b"X: " + b"a" * 20_000 + b"\r\n\r\n")
    assert 400 <= status(said) < 500, said[:100]


def test_a17_a_head_that_drips_is_given_up(served: Served) -> None:
    """One byte now and then does not keep a connection open beyond the limit."""
    began_s = time.monotonic()
    said = answer_to(served, b"GET /healthz HTTP/1.1\r\n", *([b"X-A: b\r\n"] * 20), pause_s=0.15)
    assert status(said) == 408
    assert time.monotonic() - began_s < 8


def test_a17_a_connection_that_says_nothing_is_closed(served: Served) -> None:
    """Nor one that sends only empty lines."""
    with connected(served) as quiet, connected(served) as blank:
        for _ in range(20):
            try:
                blank.sendall(b"\r\n")
            except OSError:
                break
            time.sleep(0.15)
        assert until_closed(quiet) == b""
        until_closed(blank)


@pytest.mark.parametrize("kind", ["length", "chunked"])
def test_a17_a_body_that_drips_is_given_up(served: Served, kind: str) -> None:
    """A form whose bytes come too slowly gets 408; so does one that stops."""
    told = b"Content-Length: 5000" if kind == "length" else b"Transfer-Encoding: chunked"
    part = b"a" if kind == "length" else b"1\r\na\r\n"
    head = b"POST /s/mine/begin HTTP/1.1\r\nHost: x\r\n" + told + b"\r\n\r\n"
    assert status(answer_to(served, head, *([part] * 20), pause_s=0.15)) == 408
    assert status(answer_to(served, head, part)) == 408


def test_a17_tiny_chunks_are_counted(served: Served) -> None:
    """A body of 30,000 chunks of one byte is mostly chunk sizes: refused, before its time is up."""
    said = answer_to(served, CHUNKED, *([b"1\r\na\r\n" * 500] * 60))
    assert status(said) in (413, 431)


def test_a17_an_endless_body_is_not_read_for_ever(served: Served) -> None:
    """Once a form is refused as too large, the rest of it is dropped for a moment only."""
    with connected(served) as line:
        line.sendall(b"POST /s/mine/begin HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999\r\n\r\n")
        began_s = time.monotonic()
        with contextlib.suppress(OSError):
            while time.monotonic() - began_s < 10:
                line.sendall(b"a" * MIB)
        assert time.monotonic() - began_s < 5


def test_a17_a_slow_but_honest_form_is_served(served: Served) -> None:
    """A form in pieces, within the time, is used; and the connection serves the next one."""
    head = b"POST /s/mine/begin HTTP/1.1\r\nHost: x\r\nContent-Length: 11\r\n\r\n"
    with connected(served) as line:
        for _ in range(2):
            for part in (head, b"language", b"=en"):
                line.sendall(part)
                time.sleep(0.2)
            said = line.recv(65536)
            assert status(said) == 303, said
            assert said.endswith(b"\r\n\r\n")


def test_a17_a_form_that_breaks_off_is_no_fault(served: Served, caplog: pytest.LogCaptureFixture) -> None:
    """A sibling: a browser that goes away in the middle of a form leaves no traceback in the log."""
    with connected(served) as line:
        line.sendall(b"POST /s/mine/begin HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\nabc")
        time.sleep(0.2)
    time.sleep(0.5)
    assert not [record for record in caplog.records if record.exc_info]
