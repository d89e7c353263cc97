"""The messages between browser and round: a type for each, from which the table is made that all else reads.

A field says its kind (galley.protocol.field_kinds) and what it means. docs/protocol.md, the checks of both
directions, the simulated participant and the tests of the browser's own copy go by this table.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, TypedDict, get_type_hints

from galley.protocol.field_kinds import (
    CHOICES,
    Chefs,
    Events,
    Hats,
    InputMode,
    KeyName,
    Number,
    NumberOrNull,
    Outcome,
    Partner,
    Phase,
    Pots,
    ReleaseReason,
    Seat,
    ShortText,
    ShowScore,
    Text,
    Texts,
    TextsOrNull,
    Things,
    Truth,
    Whole,
    WholeOrNull,
)

PROTOCOL: Final = 2
MAX_MESSAGE_CHARS: Final = 1024

CLOSE_REPLACED: Final = 4001
CLOSE_ENDED: Final = 4002
CLOSE_REFUSED: Final = 4003
# Of the registry of RFC 6455:
CLOSE_NORMAL: Final = 1000
CLOSE_RESTART: Final = 1012
"""The server is going down; browsers cannot send it."""
CLOSE_BUSY: Final = 1013
"""Try again later."""


# ---- from the browser --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Hello:
    """The first message of a connection; answered with a keyframe."""

    protocol: Annotated[Whole, f"version of this protocol, now {PROTOCOL}"]
    tab: Annotated[ShortText, "a random name made at each page load: two tabs have two names"]


@dataclass(frozen=True, slots=True)
class Ready:
    """The participant pressed Start, or is back after a pause: the countdown begins."""


@dataclass(frozen=True, slots=True)
class Key:
    """A key went down or up. Repeats made by the keyboard are not sent."""

    key: Annotated[KeyName, "which key"]
    down: Annotated[Truth, "true when pressed, false when let go"]
    seq: Annotated[Whole, "grows by one or more with every key and release message of a connection"]
    client_ms: Annotated[Number, "the browser's clock when it happened, ms"]


@dataclass(frozen=True, slots=True)
class Release:
    """The page lost the keyboard, or is in sight again after it was not: every held key counts as let go."""

    reason: Annotated[ReleaseReason, "what happened to the page"]
    seq: Annotated[Whole, "as in `key`"]
    client_ms: Annotated[Number, "as in `key`"]


@dataclass(frozen=True, slots=True)
class Ping:
    """Relates the two clocks; answered with a pong and stored with the round, at most once a second."""

    client_ms: Annotated[Number, "the browser's clock when it was sent, ms"]
    rtt_ms: Annotated[NumberOrNull, "round trip of the ping before, ms; null in the first"]


Incoming = Hello | Ready | Key | Release | Ping


# ---- from the server ---------------------------------------------------------------------------------


class KitchenChanges(TypedDict):
    """What of a tick the states around it decide."""

    chefs: Annotated[Chefs, "seat 0 and seat 1 as [x, y, facing, held]"]
    things: Annotated[Things, "counters that changed, as [x, y, thing]; thing 0 when now empty"]
    pots: Annotated[Pots, "pots that changed, as [x, y, onions, tomatoes, ticks, ready]"]
    score: Annotated[Whole, "points so far, of all episodes"]


class WholeKitchen(TypedDict):
    """What of a keyframe the state decides."""

    chefs: Annotated[Chefs, "seat 0 and seat 1 as [x, y, facing, held]"]
    things: Annotated[Things, "things lying on counters as [x, y, thing]"]
    pots: Annotated[Pots, "every pot as [x, y, onions, tomatoes, ticks, ready]"]
    score: Annotated[Whole, "points so far, of all episodes"]
    orders: Annotated[TextsOrNull, "soups still ordered, first first; null when any soup is good"]


class Keyframe(WholeKitchen):
    """The whole kitchen: sent after hello, when a phase begins, and after a gap."""

    type: Literal["keyframe"]
    phase: Annotated[Phase, "where the round is"]
    tick: Annotated[Whole, "ticks played of this episode"]
    horizon: Annotated[Whole, "ticks of an episode"]
    episode: Annotated[Whole, "number of the episode, from 1"]
    episodes: Annotated[Whole, "episodes of the round"]
    tick_ms: Annotated[Whole, "length of a tick, ms"]
    seat: Annotated[Seat, "the participant's seat"]
    hats: Annotated[Hats, "hat colours of seat 0 and seat 1, as this participant sees them"]
    partner: Annotated[Partner, "who plays the other seat; none: nobody, and it is not drawn"]
    input_mode: Annotated[InputMode, "whether a held direction repeats"]
    show_score: Annotated[ShowScore, "when the score is shown"]
    points: Annotated[Whole, "points of one soup"]
    grid: Annotated[
        Texts, "one text a row: X counter, P pot, O onions, T tomatoes, D dishes, S serving, space floor"
    ]
    cook_time: Annotated[Whole, "ticks a soup cooks"]
    goal: Annotated[WholeOrNull, "points that earn the bonus"]
    round: Annotated[Whole, "number of the round, 0 for a tutorial"]
    of: Annotated[Whole, "rounds of the visit"]
    tutorial: Annotated[Truth, "true when nothing counts"]


class Countdown(TypedDict):
    """Sent each second before play begins or goes on."""

    type: Literal["countdown"]
    seconds: Annotated[Whole, "seconds left"]


class Tick(KitchenChanges):
    """What one tick changed."""

    type: Literal["tick"]
    tick: Annotated[Whole, "ticks played of this episode, this one included"]
    events: Annotated[Events, "what happened, as [kind, seat, thing, place, x, y]"]


class Paused(TypedDict):
    """The kitchen stands still; `ready` goes on with it, unless the reason is partner."""

    type: Literal["paused"]
    reason: Annotated[
        Text,
        "left (the page was closed, reloaded or lost its connection), restart (of the server), or "
        "partner (the other participant is awaited)",
    ]
    seconds_left: Annotated[Whole, "seconds until the round is given up"]


class Ended(TypedDict):
    """The round is over and stored."""

    type: Literal["ended"]
    outcome: Annotated[
        Outcome,
        "finished: played to its end; abandoned: paused too long; skipped: left out; "
        "partner_left: the other participant did not come back",
    ]
    score: Annotated[Whole, "points"]
    next: Annotated[Text, "the page to go on to"]


class Pong(TypedDict):
    """Answers a ping."""

    type: Literal["pong"]
    client_ms: Annotated[Number, "as the ping said"]
    server_ms: Annotated[Number, "the server's clock, ms since 1970"]


class Elsewhere(TypedDict):
    """The round was opened in another tab, which has it now; this connection closes."""

    type: Literal["elsewhere"]


class Refused(TypedDict):
    """A message could not be used; the round goes on as if it had not been sent."""

    type: Literal["refused"]
    reason: Annotated[Text, "what was wrong with it"]


Outgoing = Keyframe | Countdown | Tick | Paused | Ended | Pong | Elsewhere | Refused


# ---- the table ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message: name, kind (one of galley.protocol.field_kinds) and what it says."""

    name: str
    kind: str
    about: str


@dataclass(frozen=True, slots=True)
class Message:
    """One row of the protocol: its name and type, who sends it, when, and its fields besides `type`."""

    name: str
    kind: type
    sender: Literal["client", "server"]
    about: str
    fields: tuple[Field, ...]


def _fields(kind: type) -> Iterator[Field]:
    """The fields of a message in the order of the docs: its own before those of the kitchen."""
    hints: Mapping[str, Any] = get_type_hints(kind, include_extras=True)
    parts = [set(part.__annotations__) for part in (WholeKitchen, KitchenChanges)]
    of_kitchen = {name for part in parts if part <= hints.keys() for name in part}
    for name in sorted(hints, key=lambda name: name in of_kitchen):
        if name != "type":
            field_kind, about = hints[name].__metadata__
            yield Field(name, field_kind, about)


def _rows(sender: Literal["client", "server"], *kinds: type) -> Iterator[Message]:
    for kind in kinds:
        yield Message(kind.__name__.lower(), kind, sender, str(kind.__doc__), tuple(_fields(kind)))


MESSAGES: tuple[Message, ...] = (
    *_rows("client", Hello, Ready, Key, Release, Ping),
    *_rows("server", Keyframe, Countdown, Tick, Paused, Ended, Pong, Elsewhere, Refused),
)
CLIENT: Mapping[str, Message] = {row.name: row for row in MESSAGES if row.sender == "client"}
SERVER: Mapping[str, Message] = {row.name: row for row in MESSAGES if row.sender == "server"}


def tables() -> str:
    """The protocol's messages as Markdown, for docs/protocol.md."""
    lines: list[str] = []
    for rows, title in ((CLIENT, "From the browser"), (SERVER, "From the server")):
        lines += [f"### {title}", ""]
        for message in rows.values():
            lines += [f"#### `{message.name}`", "", message.about, ""]
            if message.fields:
                lines += ["| field | kind | meaning |", "|---|---|---|"]
                for field in message.fields:
                    choices = CHOICES.get(field.kind)
                    kind = field.kind if choices is None else f"{field.kind}: {', '.join(choices)}"
                    lines.append(f"| `{field.name}` | {kind} | {field.about} |")
                lines.append("")
    return "\n".join(lines).rstrip() + "\n"
