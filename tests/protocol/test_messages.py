"""What the wire lets in, and that its table, its classes and its docs agree."""

from __future__ import annotations

import dataclasses
import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.protocol import messages as wire

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
    message = wire.parse(frame(kind))
    assert type(message).__name__.lower() == kind
    assert dataclasses.asdict(message) == GOOD[kind]


def test_the_table_names_the_fields_of_the_classes() -> None:
    for name, message in wire.CLIENT.items():
        parsed = wire.parse(frame(name))
        assert [field.name for field in dataclasses.fields(parsed)] == [f.name for f in message.fields]
    assert set(wire.CLIENT) == set(GOOD)


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
    with pytest.raises(wire.MessageError, match=reason.replace("[", r"\[")):
        wire.parse(text)


@given(st.text(max_size=200) | st.binary(max_size=50))
def test_no_text_does_anything_but_be_refused(text: str | bytes) -> None:
    with pytest.raises(wire.MessageError):
        wire.parse(text)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@given(st.sampled_from(sorted(GOOD)), st.data())
def test_a_message_with_any_field_replaced_is_understood_or_refused(kind: str, data: st.DataObject) -> None:
    fields = {"type": kind, **GOOD[kind]}
    fields[data.draw(st.sampled_from(sorted(fields)))] = data.draw(JSON)
    with suppress(wire.MessageError):
        assert isinstance(wire.parse(json.dumps(fields)), wire.Incoming)


def test_encode_gives_one_json_object_with_its_type() -> None:
    assert json.loads(wire.encode("countdown", seconds=3)) == {"type": "countdown", "seconds": 3}


def test_the_protocol_page_holds_the_table_as_it_is() -> None:
    page = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert wire.tables() in page, "write galley.protocol.messages.tables() into docs/protocol.md"
    assert f"version {wire.PROTOCOL}" in page
    for code in (wire.CLOSE_REPLACED, wire.CLOSE_ENDED, wire.CLOSE_REFUSED):
        assert f"`{code}`" in page
