"""The browser's copy of the protocol says what the server's table says."""

from __future__ import annotations

import re

import pytest

from galley.protocol import field_kinds, messages
from tests.frontend.pages import FRONTEND

TEXT = (FRONTEND / "js/messages.js").read_text(encoding="utf-8")


def _list(name: str) -> list[str]:
    (row,) = re.findall(rf"export const {name} = .*?\(\[(.*?)\]\)", TEXT, re.S)
    return re.findall(r'"(\w+)"', row)


def _union(name: str) -> list[str]:
    (row,) = re.findall(rf"@typedef \{{([^}}]*)\}} {name} ", TEXT)
    return re.findall(r'"(\w+)"', row)


def _shapes() -> dict[str, tuple[set[str], set[str]]]:
    """(needed, optional) fields of each message by its type, however its type is written down."""
    shapes = {}
    for row in re.findall(r'\{type: "[^{}]*\}', TEXT):
        fields = re.findall(r"(\w+):", row)
        shapes[re.findall(r'type: "(\w+)"', row)[0]] = set(fields) - {"type"}, set[str]()
    for block in re.findall(r"/\*\*(.*?)\*/", TEXT, re.S):
        if found := re.search(r'@property \{"(\w+)"\} type', block):
            needed = set(re.findall(r"@property \{.*\} (\w+)", block)) - {"type"}
            shapes[found[1]] = needed, set(re.findall(r"@property \{.*\} \[(\w+)\]", block))
    return shapes


def test_types_are_those_of_the_table() -> None:
    assert _list("CLIENT_TYPES") == list(messages.CLIENT)
    assert sorted(_list("SERVER_TYPES")) == sorted(messages.SERVER)


def test_words_are_those_of_the_table() -> None:
    assert _list("KEYS") == list(field_kinds.KEYS)
    assert _union("ReleaseReason") == list(field_kinds.RELEASE_REASONS)
    assert _union("Phase") == list(field_kinds.PHASES)
    assert f"PROTOCOL = {messages.PROTOCOL};" in TEXT


def test_close_codes_are_those_of_the_server() -> None:
    codes = dict(re.findall(r"(\w+): (4\d+)", TEXT))
    wanted = {
        "elsewhere": messages.CLOSE_REPLACED,
        "over": messages.CLOSE_ENDED,
        "refused": messages.CLOSE_REFUSED,
    }
    assert {name: int(code) for name, code in codes.items()} == wanted


@pytest.mark.parametrize("message", messages.MESSAGES, ids=lambda message: message.name)
def test_fields_are_those_of_the_table(message: messages.Message) -> None:
    needed, optional = _shapes()[message.name]
    fields = {field.name for field in message.fields}
    assert needed <= fields <= needed | optional
