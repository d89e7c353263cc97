"""Messages and the text of their frames, both ways; what is not as the table says is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import orjson

from galley.protocol.field_kinds import CHOICES, holds
from galley.protocol.messages import CLIENT, MAX_MESSAGE_CHARS, SERVER, Incoming, Message, Outgoing


class MessageError(ValueError):
    """A message that cannot be used; the text is the reason, for a browser's message also for its sender."""


def parse(frame: str | bytes) -> Incoming:
    """The message in one frame from a browser.

    Raises:
        MessageError: with the reason, when it is none of the table's, or not as the table says.
    """
    if isinstance(frame, str) and len(frame) > MAX_MESSAGE_CHARS:
        raise MessageError(f"messages have at most {MAX_MESSAGE_CHARS} characters, this one {len(frame)}")
    message, content = _checked(frame, CLIENT)
    found: Incoming = message.kind(**content)
    return found


def encode(message: Outgoing) -> str:
    """A server's message as the text of its frame. Types say what it holds; `parse_outgoing` checks it."""
    return orjson.dumps(message).decode()


def parse_outgoing(frame: str | bytes) -> dict[str, Any]:
    """A server's message, its `type` included, as a page gets it.

    Raises:
        MessageError: as in `parse`.
    """
    message, content = _checked(frame, SERVER)
    return {"type": message.name, **content}


def encode_incoming(message: Incoming) -> str:
    """A browser's message as the text of its frame, for browsers that are made of code."""
    content = {field.name: getattr(message, field.name) for field in fields(message)}
    return orjson.dumps({"type": type(message).__name__.lower(), **content}).decode()


def _checked(frame: str | bytes, rows: Mapping[str, Message]) -> tuple[Message, dict[str, Any]]:
    """The row of a frame's message, and its fields without `type`."""
    if isinstance(frame, bytes):
        raise MessageError("messages are text, not binary")
    try:
        content = orjson.loads(frame)
    except (orjson.JSONDecodeError, UnicodeEncodeError) as error:
        raise MessageError("messages are JSON") from error
    if not isinstance(content, dict):
        raise MessageError("messages are JSON objects")
    name = content.pop("type", None)
    message = rows.get(name) if isinstance(name, str) else None
    if message is None:
        raise MessageError(f"type is one of {', '.join(rows)}")
    for field in message.fields:
        if field.name not in content:
            raise MessageError(f"{message.name} lacks {field.name}")
        if not holds(field.kind, content[field.name]):
            allowed = CHOICES.get(field.kind)
            raise MessageError(
                f"{field.name} is {'one of ' + ', '.join(allowed) if allowed else 'a ' + field.kind}"
            )
    if len(content) != len(message.fields):
        raise MessageError(f"{message.name} has fields it should not have")
    return message, content
