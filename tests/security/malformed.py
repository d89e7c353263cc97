"""Messages that no browser of ours sends, drawn from a seed."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from typing import Any

from galley.protocol.messages import CLIENT, MAX_MESSAGE_CHARS

ODD: tuple[Any, ...] = (
    *(
        None,
        True,
        -1,
        2**53,
        2**70,
        1e308,
        -0.0,
        "",
        "\0",
        "up\n",
        "\ud800",
        "x" * 500,
        [],
        {},
        [[]],
        {"type": 1},
    ),
    *("__proto__", "constructor", "../../etc/passwd", "<script>", "' OR 1=1 --", "%s%n", "\u202e", "🍲" * 20),
)
RAW = (
    *("", " ", "null", "[]", "0", "true", '"key"', "{", "}", '{"type"', '{"type":"key"', "NaN", "Infinity"),
    *('{"type":"ping","client_ms":NaN,"rtt_ms":null}', '{"type":"ping","client_ms":1e999,"rtt_ms":null}'),
    *('{"type":"ready","type":"hello"}', '{"type":"\\ud800"}', "\ufeff{}", "'ready'", "<xml/>", "[" * 1000),
    *('{"a":' * 150 + "1" + "}" * 150, "9" * 1000, "\0" * 10, "x" * (MAX_MESSAGE_CHARS + 1), "é" * 700),
)
GOOD = {
    "hello": {"protocol": 2, "tab": "again"},
    "ready": {},
    "key": {"key": "up", "down": True, "seq": 0, "client_ms": 1.0},
    "release": {"reason": "blur", "seq": 0, "client_ms": 1.0},
    "ping": {"client_ms": 1.0, "rtt_ms": None},
}


def malformed(seed: int, count: int) -> Iterator[str | bytes]:
    """So many messages, none of which is valid in a round that has begun."""
    rng = random.Random(seed)
    for _ in range(count):
        match rng.randrange(5):
            case 0:
                yield rng.choice(RAW)
            case 1:
                yield rng.randbytes(rng.randrange(200))
            case 2:
                yield _cut(rng)
            case 3:
                yield _odd_field(rng)
            case _:
                yield "".join(chr(rng.randrange(1, 0xD7FF)) for _ in range(rng.randrange(1, 60)))


def _cut(rng: random.Random) -> str:
    """A good message with a piece missing from its end."""
    name = rng.choice(list(GOOD))
    whole = json.dumps({"type": name, **GOOD[name]})
    return whole[: rng.randrange(1, len(whole) - 1)]


def _odd_field(rng: random.Random) -> str:
    """A message with a field too many, too few or of another kind."""
    name = rng.choice([one for one in CLIENT if one != "ready"])
    fields: dict[str, Any] = {"type": name, **GOOD[name]}
    match rng.randrange(3):
        case 0:
            del fields[rng.choice([field for field in fields if field != "type"])]
        case 1:
            fields[f"extra{rng.randrange(9)}"] = rng.choice(ODD)
        case _:
            fields["type"] = rng.choice(ODD)
    return json.dumps(fields)
