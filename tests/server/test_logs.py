"""The log: no secrets at any level (A8), one line each, repeats counted (A7)."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from sqlalchemy.exc import OperationalError

from galley.server import logs
from galley.server.logs import hidden, log_to
from tests.server.helpers import ONE_ROUND, Participant, serving
from tests.study.workspaces import study_workspace

LOG = logging.getLogger("galley.test")


@pytest.fixture
def log() -> Iterator[io.StringIO]:
    stream = io.StringIO()
    root = logging.getLogger()
    level = root.level
    handler = log_to(stream, "debug")
    yield stream
    root.removeHandler(handler)
    handler.close()
    root.setLevel(level)


@pytest.mark.parametrize("level", ["debug", "info"])
def test_a8_no_token_reaches_the_log(log: io.StringIO, tmp_path: Path, level: str) -> None:
    """A whole visit with a round, a test link that is bad, a researcher's cookie: at the chattiest levels."""
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    secrets = ["test-token-1234", "cookie-5678", "invitation-9"]
    with serving(lab, tmp_path / "records.sqlite", log_level=level) as server:
        person = Participant(server)
        person.agree()
        with person.play() as player:
            player.whole_round()
        httpx.get(f"{server.url}/s/mine?galley-test=test-token-1234&code=invitation-9")
        httpx.get(f"{server.url}/researcher", headers={"cookie": "galley_researcher=cookie-5678"})
        httpx.post(f"{server.url}{person.path}", content=b"x" * 1_000_000)
    said = log.getvalue()
    assert "/v/…" in said, "something was said about sockets, without the token"
    assert [secret for secret in (person.token, *secrets) if secret in said] == []


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ('"WebSocket /v/AbC-_123/play" [accepted]', '"WebSocket /v/…/play" [accepted]'),
        ("GET /v/AbC HTTP/1.1", "GET /v/… HTTP/1.1"),
        ("< Cookie: galley_researcher=abc; other=d", "< Cookie: …"),
        ("/s/mine?galley-test=abc&language=en", "/s/mine?galley-test=…&language=en"),
        ("Row(id=1, token='abc', seed=2)", "Row(id=1, token='…', seed=2)"),
        ("{'token': 'abc', 'seed': 2}", "{'token': '…', 'seed': 2}"),
        ("round 7 was taken over", "round 7 was taken over"),
    ],
)
def test_a8_what_is_hidden(text: str, left: str) -> None:
    assert hidden(text) == left


def test_a7_what_is_expected_to_fail_takes_one_line(log: io.StringIO) -> None:
    """A full disk, a broken frame: no traceback; line breaks of an attacker make no lines."""
    for error in (
        OperationalError("insert", {}, Exception("disk is full")),
        UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid\nINFO forged line"),
    ):
        try:
            raise error
        except Exception:
            LOG.exception("it failed")
    lines = log.getvalue().splitlines()
    assert len(lines) == 2
    assert "disk is full" in lines[0]


def test_a7_our_own_faults_are_told_in_full_once(log: io.StringIO) -> None:
    for _ in range(3):
        try:
            _ = 1 // 0
        except ZeroDivisionError:
            LOG.exception("a page broke")
    assert log.getvalue().count("Traceback") == 1
    assert log.getvalue().count("a page broke (ZeroDivisionError") == 3


def test_a7_repeats_are_counted(log: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    """20,000 in a moment leave five lines and a count; another kind is heard all the same."""
    now = [0.0]
    monkeypatch.setattr(logs.time, "monotonic", lambda: now[0])
    for number in range(20_000):
        LOG.warning("socket %d failed", number)
    LOG.warning("something else")
    now[0] = 11.0
    LOG.warning("later")
    lines = log.getvalue().splitlines()
    assert len(lines) == 8
    assert lines[5].endswith("something else")
    assert "19995 more in 10 s: socket %d failed" in lines[6]


def test_a7_a_broken_frame_leaves_one_line(log: io.StringIO, tmp_path: Path) -> None:
    """Broken UTF-8 on a socket, as found."""
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    with serving(lab, tmp_path / "records.sqlite") as server:
        person = Participant(server)
        person.agree()
        with person.play() as player:
            player.socket.send(b"\xff\xfe", text=True)
            assert player.closed_with() == 1007
    assert "Traceback" not in log.getvalue()
    assert log.getvalue().count("Invalid UTF-8") == 1
