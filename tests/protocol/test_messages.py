"""What is let in, and that its table, its classes and its docs agree."""

from __future__ import annotations

import dataclasses
import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.protocol import codec, messages

ROOT = Path(__file__).parents[2]
GOOD: dict[str, dict[str, Any]] = {
    "hello": {"protocol": 2, "tab": "a1b2"},
    "ready": {},
    "key": {"key": "left", "down": True, "seq": 3, "client_ms": 12.5},
    "release": {"reason": "blur", "seq": 4, "client_ms": 13},
    "ping": {"client_ms": 14.0, "rtt_ms": None},
}


def frame(kind: str, **changes: Any) -> str:
    return json.dumps({"type": kind, **GOOD[kind], **changes})


@pytest.mark.parametrize("kind", GOOD)
def test_every_message_of_the_browser_is_understood(kind: str) -> None:
    message = codec.parse(frame(kind))
    assert type(message).__name__.lower() == kind
    assert dataclasses.asdict(message) == GOOD[kind]


def test_the_table_names_the_fields_of_the_classes() -> None:
    for name, message in messages.CLIENT.items():
        parsed = codec.parse(frame(name))
        assert [field.name for field in dataclasses.fields(parsed)] == [f.name for f in message.fields]
    assert set(messages.CLIENT) == set(GOOD)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (b'{"type":"ready"}', "text, not binary"),
        ("{", "JSON"),
        ("", "JSON"),
        ("[]", "objects"),
        ("null", "objects"),
        ("{}", "type is one of"),
        ('{"type":"tick"}', "type is one of"),
        ('{"type":["ready"]}', "type is one of"),
        ('{"type":"ready","more":1}', "fields it should not have"),
        ('{"type":"ping","client_ms":1}', "lacks rtt_ms"),
        (frame("ping", client_ms="1"), "client_ms is a number"),
        ('{"type":"ping","client_ms":NaN,"rtt_ms":null}', "JSON"),
        ('{"type":"ping","client_ms":1e999,"rtt_ms":null}', "JSON|a number"),
        (frame("ping", client_ms=1e20), "client_ms is a number"),
        (frame("ping", client_ms=True), "client_ms is a number"),
        (frame("key", key="jump"), "one of up, down, left, right, interact"),
        (frame("key", key=["up"]), "one of up"),
        (frame("key", down=1), "down is a true or false"),
        (frame("key", seq=-1), "seq is a whole number"),
        (frame("key", seq=1.5), "seq is a whole number"),
        (frame("key", seq=10**30), "JSON|whole number"),
        (frame("hello", tab=""), "tab is a short text"),
        (frame("hello", tab="x" * 65), "tab is a short text"),
        (frame("hello", tab="a\nb"), "tab is a short text"),
        ("[" * 1000, "JSON"),
        (" " * 1025, "at most 1024 characters"),
        ('"\ud800"', "JSON"),
    ],
)
def test_what_is_no_message_is_refused_with_the_reason(text: str | bytes, reason: str) -> None:
    with pytest.raises(codec.MessageError, match=reason.replace("[", r"\[")):
        codec.parse(text)


@given(st.text(max_size=200) | st.binary(max_size=50))
def test_no_text_does_anything_but_be_refused(text: str | bytes) -> None:
    with pytest.raises(codec.MessageError):
        codec.parse(text)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@given(st.sampled_from(sorted(GOOD)), st.data())
def test_a_message_with_any_field_replaced_is_understood_or_refused(kind: str, data: st.DataObject) -> None:
    fields = {"type": kind, **GOOD[kind]}
    fields[data.draw(st.sampled_from(sorted(fields)))] = data.draw(JSON)
    with suppress(codec.MessageError):
        assert isinstance(codec.parse(json.dumps(fields)), messages.Incoming)


def test_encode_gives_one_json_object_with_its_type() -> None:
    countdown: messages.Countdown = {"type": "countdown", "seconds": 3}
    assert json.loads(codec.encode(countdown)) == {"type": "countdown", "seconds": 3}
    assert codec.parse_outgoing(codec.encode(countdown)) == countdown


CHEF = [1, 1, 0, 0]
TICK = {"type": "tick", "tick": 1, "chefs": [CHEF, CHEF], "things": [], "pots": [], "score": 0, "events": []}


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        ({"type": "countdown", "seconds": -1}, "seconds is a whole number"),
        ({"type": "countdown"}, "countdown lacks seconds"),
        ({"type": "countdown", "seconds": 1, "more": 1}, "fields it should not have"),
        ({"type": "ready"}, "type is one of keyframe"),
        ({"type": "ended", "outcome": "won", "score": 1, "next": "/v/x"}, "outcome is one of finished"),
        ({**TICK, "chefs": [CHEF]}, "chefs is a list of two chefs"),
        ({**TICK, "things": [[1, 2]]}, "things is a list of things"),
        ({**TICK, "pots": [[1, 2, 3, 4, 5, 1]]}, "pots is a list of pots"),
        ({**TICK, "events": [["delivery", 2, 4, "serving", 1, 1]]}, "events is a list of events"),
    ],
)
def test_what_the_server_should_not_say_is_found(message: dict[str, Any], reason: str) -> None:
    assert codec.parse_outgoing(json.dumps(TICK)) == TICK
    with pytest.raises(codec.MessageError, match=reason):
        codec.parse_outgoing(json.dumps(message))


@pytest.mark.parametrize("kind", GOOD)
def test_browsers_made_of_code_say_what_is_understood(kind: str) -> None:
    message = codec.parse(frame(kind))
    assert codec.parse(codec.encode_incoming(message)) == message


def test_the_protocol_page_holds_the_table_as_it_is() -> None:
    page = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert messages.tables() in page, "write galley.protocol.messages.tables() into docs/protocol.md"
    assert f"version {messages.PROTOCOL}" in page
    for code in (messages.CLOSE_REPLACED, messages.CLOSE_ENDED, messages.CLOSE_REFUSED):
        assert f"`{code}`" in page
