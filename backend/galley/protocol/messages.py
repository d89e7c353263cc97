"""The messages between browser and round: one table that parsing, docs/protocol.md and the tests read."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import orjson

from galley.outcomes import ROUND_OUTCOMES

PROTOCOL = 2
MAX_MESSAGE_CHARS = 1024
KEYS = ("up", "down", "left", "right", "interact")
RELEASE_REASONS = ("blur", "hidden", "shown", "pagehide")
PHASES = ("waiting", "countdown", "playing", "paused", "ended")
OUTCOMES = (*ROUND_OUTCOMES, "partner_left")
SHOW_SCORE = ("during", "after", "never")
INPUT_MODES = ("hold", "press")
PARTNERS = ("agent", "human", "none")
CLOSE_REPLACED = 4001
CLOSE_ENDED = 4002
CLOSE_REFUSED = 4003
CLOSE_BUSY = 1013  # RFC 6455 registry: try again later


class MessageError(ValueError):
    """A message from the browser that cannot be used; the text is the reason the sender is given."""


def _whole(value: object) -> bool:
    return type(value) is int and 0 <= value < 2**53


def _number(value: object) -> bool:
    return type(value) in (int, float) and math.isfinite(value) and abs(value) < 1e15  # type: ignore[arg-type]


def _one_of(*choices: str) -> Callable[[object], bool]:
    return lambda value: isinstance(value, str) and value in choices


def _list(value: object) -> bool:
    return isinstance(value, list)


# Kinds of field: how the docs say them, and the check. A kind ending in "or null" also allows null.
CHECKS: Mapping[str, Callable[[object], bool]] = {
    "whole number": _whole,
    "number": _number,
    "true or false": lambda value: isinstance(value, bool),
    "0 or 1": lambda value: type(value) is int and value in (0, 1),
    "short text": lambda value: (
        isinstance(value, str) and re.fullmatch(r"[\x20-\x7e]{1,64}", value) is not None
    ),
    "text": lambda value: isinstance(value, str),
    "list": _list,
    "key": _one_of(*KEYS),
    "release reason": _one_of(*RELEASE_REASONS),
    "phase": _one_of(*PHASES),
    "outcome": _one_of(*OUTCOMES),
    "score visibility": _one_of(*SHOW_SCORE),
    "input mode": _one_of(*INPUT_MODES),
    "partner": _one_of(*PARTNERS),
}
CHOICES: Mapping[str, tuple[str, ...]] = {
    "key": KEYS,
    "release reason": RELEASE_REASONS,
    "phase": PHASES,
    "outcome": OUTCOMES,
    "score visibility": SHOW_SCORE,
    "input mode": INPUT_MODES,
    "partner": PARTNERS,
}


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message: name, kind (a key of CHECKS, perhaps with " or null") and what it says."""

    name: str
    kind: str
    about: str

    def holds(self, value: object) -> bool:
        """True when the value is of this field's kind."""
        kind = self.kind.removesuffix(" or null")
        if value is None:
            return kind != self.kind
        return CHECKS[kind](value)


@dataclass(frozen=True, slots=True)
class Message:
    """One row of the protocol: who sends it, when, and its fields besides `type`."""

    name: str
    sender: str
    about: str
    fields: tuple[Field, ...] = ()


MESSAGES: tuple[Message, ...] = (
    Message(
        "hello",
        "client",
        "The first message of a connection; answered with a keyframe.",
        (
            Field("protocol", "whole number", f"version of this protocol, now {PROTOCOL}"),
            Field("tab", "short text", "a random name made at each page load: two tabs have two names"),
        ),
    ),
    Message(
        "ready", "client", "The participant pressed Start, or is back after a pause: the countdown begins."
    ),
    Message(
        "key",
        "client",
        "A key went down or up. Repeats made by the keyboard are not sent.",
        (
            Field("key", "key", "which key"),
            Field("down", "true or false", "true when pressed, false when let go"),
            Field(
                "seq",
                "whole number",
                "grows by one or more with every key and release message of a connection",
            ),
            Field("client_ms", "number", "the browser's clock when it happened, ms"),
        ),
    ),
    Message(
        "release",
        "client",
        "The page lost the keyboard, or is in sight again after it was not: every held key counts as let go.",
        (
            Field("reason", "release reason", "what happened to the page"),
            Field("seq", "whole number", "as in `key`"),
            Field("client_ms", "number", "as in `key`"),
        ),
    ),
    Message(
        "ping",
        "client",
        "Relates the two clocks; answered with a pong and stored with the round, at most once a second.",
        (
            Field("client_ms", "number", "the browser's clock when it was sent, ms"),
            Field("rtt_ms", "number or null", "round trip of the ping before, ms; null in the first"),
        ),
    ),
    Message(
        "keyframe",
        "server",
        "The whole kitchen: sent after hello, when a phase begins, and after a gap.",
        (
            Field("phase", "phase", "where the round is"),
            Field("tick", "whole number", "ticks played of this episode"),
            Field("horizon", "whole number", "ticks of an episode"),
            Field("episode", "whole number", "number of the episode, from 1"),
            Field("episodes", "whole number", "episodes of the round"),
            Field("tick_ms", "whole number", "length of a tick, ms"),
            Field("seat", "0 or 1", "the participant's seat"),
            Field("hats", "list", "hat colours of seat 0 and seat 1, as this participant sees them"),
            Field("partner", "partner", "who plays the other seat; none: nobody, and it is not drawn"),
            Field("input_mode", "input mode", "whether a held direction repeats"),
            Field("show_score", "score visibility", "when the score is shown"),
            Field("points", "whole number", "points of one soup"),
            Field(
                "grid",
                "list",
                "one text a row: X counter, P pot, O onions, T tomatoes, D dishes, S serving, space floor",
            ),
            Field("cook_time", "whole number", "ticks a soup cooks"),
            Field("chefs", "list", "seat 0 and seat 1 as [x, y, facing, held]"),
            Field("things", "list", "things lying on counters as [x, y, thing]"),
            Field("pots", "list", "every pot as [x, y, onions, tomatoes, ticks, ready]"),
            Field("score", "whole number", "points so far, of all episodes"),
            Field("goal", "whole number or null", "points that earn the bonus"),
            Field("round", "whole number", "number of the round, 0 for a tutorial"),
            Field("of", "whole number", "rounds of the visit"),
            Field("tutorial", "true or false", "true when nothing counts"),
            Field("orders", "list or null", "soups still ordered, first first; null when any soup is good"),
        ),
    ),
    Message(
        "countdown",
        "server",
        "Sent each second before play begins or goes on.",
        (Field("seconds", "whole number", "seconds left"),),
    ),
    Message(
        "tick",
        "server",
        "What one tick changed.",
        (
            Field("tick", "whole number", "ticks played of this episode, this one included"),
            Field("chefs", "list", "as in the keyframe"),
            Field("things", "list", "counters that changed, as [x, y, thing]; thing 0 when now empty"),
            Field("pots", "list", "pots that changed, as in the keyframe"),
            Field("score", "whole number", "points so far, of all episodes"),
            Field("events", "list", "what happened, as [kind, seat, thing, place, x, y]"),
        ),
    ),
    Message(
        "paused",
        "server",
        "The kitchen stands still; `ready` goes on with it, unless the reason is partner.",
        (
            Field(
                "reason",
                "text",
                "left (the page was closed, reloaded or lost its connection), restart (of the server), or "
                "partner (the other participant is awaited)",
            ),
            Field("seconds_left", "whole number", "seconds until the round is given up"),
        ),
    ),
    Message(
        "ended",
        "server",
        "The round is over and stored.",
        (
            Field(
                "outcome",
                "outcome",
                "finished: played to its end; abandoned: paused too long; skipped: left out; "
                "partner_left: the other participant did not come back",
            ),
            Field("score", "whole number", "points"),
            Field("next", "text", "the page to go on to"),
        ),
    ),
    Message(
        "pong",
        "server",
        "Answers a ping.",
        (
            Field("client_ms", "number", "as the ping said"),
            Field("server_ms", "number", "the server's clock, ms since 1970"),
        ),
    ),
    Message(
        "elsewhere",
        "server",
        "The round was opened in another tab, which has it now; this connection closes.",
    ),
    Message(
        "refused",
        "server",
        "A message could not be used; the round goes on as if it had not been sent.",
        (Field("reason", "text", "what was wrong with it"),),
    ),
)
CLIENT: Mapping[str, Message] = {m.name: m for m in MESSAGES if m.sender == "client"}
SERVER: Mapping[str, Message] = {m.name: m for m in MESSAGES if m.sender == "server"}


@dataclass(frozen=True, slots=True)
class Hello:
    """The first message of a connection."""

    protocol: int
    tab: str


@dataclass(frozen=True, slots=True)
class Ready:
    """The participant is ready to play."""


@dataclass(frozen=True, slots=True)
class Key:
    """A key went down or up."""

    key: str
    down: bool
    seq: int
    client_ms: float


@dataclass(frozen=True, slots=True)
class Release:
    """All keys count as let go."""

    reason: str
    seq: int
    client_ms: float


@dataclass(frozen=True, slots=True)
class Ping:
    """The browser's clock now, and the last round trip."""

    client_ms: float
    rtt_ms: float | None


Incoming = Hello | Ready | Key | Release | Ping
_CLASSES: Mapping[str, Callable[..., Incoming]] = {
    "hello": Hello,
    "ready": Ready,
    "key": Key,
    "release": Release,
    "ping": Ping,
}


def parse(frame: str | bytes) -> Incoming:
    """The message in one frame from a browser.

    Raises: MessageError with the reason when it is none of the table's, or not as the table says.
    """
    if isinstance(frame, bytes):
        raise MessageError("messages are text, not binary")
    if len(frame) > MAX_MESSAGE_CHARS:
        raise MessageError(f"messages have at most {MAX_MESSAGE_CHARS} characters, this one {len(frame)}")
    try:
        content = orjson.loads(frame)
    except (orjson.JSONDecodeError, UnicodeEncodeError) as error:
        raise MessageError("messages are JSON") from error
    if not isinstance(content, dict):
        raise MessageError("messages are JSON objects")
    name = content.pop("type", None)
    message = CLIENT.get(name) if isinstance(name, str) else None
    if message is None:
        raise MessageError(f"type is one of {', '.join(CLIENT)}")
    for field in message.fields:
        if field.name not in content:
            raise MessageError(f"{message.name} lacks {field.name}")
        if not field.holds(content[field.name]):
            allowed = CHOICES.get(field.kind)
            raise MessageError(
                f"{field.name} is {'one of ' + ', '.join(allowed) if allowed else 'a ' + field.kind}"
            )
    if len(content) != len(message.fields):
        raise MessageError(f"{message.name} has fields it should not have")
    return _CLASSES[message.name](**content)


def encode(name: str, **fields: Any) -> str:
    """A server message as the text of its frame."""
    return orjson.dumps({"type": name, **fields}).decode()


def tables() -> str:
    """The protocol's messages as Markdown, for docs/protocol.md."""
    lines: list[str] = []
    for sender, title in (("client", "From the browser"), ("server", "From the server")):
        lines += [f"### {title}", ""]
        for message in MESSAGES:
            if message.sender != sender:
                continue
            lines += [f"#### `{message.name}`", "", message.about, ""]
            if message.fields:
                lines += ["| field | kind | meaning |", "|---|---|---|"]
                for field in message.fields:
                    choices = CHOICES.get(field.kind)
                    kind = field.kind if choices is None else f"{field.kind}: {', '.join(choices)}"
                    lines.append(f"| `{field.name}` | {kind} | {field.about} |")
                lines.append("")
    return "\n".join(lines).rstrip() + "\n"
