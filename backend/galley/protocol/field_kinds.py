"""The kinds of field that messages have: the name of each in the docs, its check, the words it allows."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Final

from galley.outcomes import ROUND_OUTCOMES

KEYS = ("up", "down", "left", "right", "interact")
RELEASE_REASONS = ("blur", "hidden", "shown", "pagehide", "meta")
PHASES = ("waiting", "countdown", "playing", "paused", "ended")
OUTCOMES = (*ROUND_OUTCOMES, "partner_left")
SHOW_SCORE = ("during", "after", "never")
INPUT_MODES = ("hold", "press")
PARTNERS = ("agent", "human", "none")

OR_NULL: Final = " or null"

Whole = Annotated[int, "whole number"]
WholeOrNull = Annotated[int | None, "whole number or null"]
Number = Annotated[float, "number"]
NumberOrNull = Annotated[float | None, "number or null"]
Truth = Annotated[bool, "true or false"]
Seat = Annotated[int, "0 or 1"]
ShortText = Annotated[str, "short text"]
Text = Annotated[str, "text"]
Texts = Annotated[list[str], "list of texts"]
TextsOrNull = Annotated[list[str] | None, "list of texts or null"]
KeyName = Annotated[str, "key"]
ReleaseReason = Annotated[str, "release reason"]
Phase = Annotated[str, "phase"]
Outcome = Annotated[str, "outcome"]
ShowScore = Annotated[str, "score visibility"]
InputMode = Annotated[str, "input mode"]
Partner = Annotated[str, "partner"]
Hats = Annotated[list[str], "two texts"]
Chefs = Annotated[list[list[int]], "list of two chefs"]
Things = Annotated[list[list[int]], "list of things"]
Pots = Annotated[list[list[int | bool]], "list of pots"]
Events = Annotated[list[list[Any]], "list of events"]

Check = Callable[[object], bool]


def _whole(value: object) -> bool:
    return type(value) is int and 0 <= value < 2**53


def _number(value: object) -> bool:
    return type(value) in (int, float) and math.isfinite(value) and abs(value) < 1e15  # type: ignore[arg-type]


def _truth(value: object) -> bool:
    return isinstance(value, bool)


def _text(value: object) -> bool:
    return isinstance(value, str)


def _seat(value: object) -> bool:
    return type(value) is int and value in (0, 1)


def _one_of(*choices: str) -> Check:
    return lambda value: isinstance(value, str) and value in choices


def _maybe(check: Check) -> Check:
    return lambda value: value is None or check(value)


def _list(check: Check, count: int | None = None) -> Check:
    return lambda value: (
        isinstance(value, list) and count in (None, len(value)) and all(check(one) for one in value)
    )


def _row(*checks: Check) -> Check:
    return lambda value: (
        isinstance(value, list)
        and len(value) == len(checks)
        and all(check(one) for check, one in zip(checks, value, strict=True))
    )


CHOICES: Mapping[str, tuple[str, ...]] = {
    "key": KEYS,
    "release reason": RELEASE_REASONS,
    "phase": PHASES,
    "outcome": OUTCOMES,
    "score visibility": SHOW_SCORE,
    "input mode": INPUT_MODES,
    "partner": PARTNERS,
}
"""Kinds that are one of a few words."""

CHECKS: Mapping[str, Check] = {
    "whole number": _whole,
    "number": _number,
    "true or false": _truth,
    "0 or 1": _seat,
    "short text": lambda value: (
        isinstance(value, str) and re.fullmatch(r"[\x20-\x7e]{1,64}", value) is not None
    ),
    "text": _text,
    "two texts": _list(_text, 2),
    "list of texts": _list(_text),
    "list of two chefs": _list(_row(_whole, _whole, _whole, _whole), 2),
    "list of things": _list(_row(_whole, _whole, _whole)),
    "list of pots": _list(_row(_whole, _whole, _whole, _whole, _whole, _truth)),
    "list of events": _list(
        _row(
            _text,
            _maybe(_seat),
            _maybe(lambda value: _text(value) or _whole(value)),
            _maybe(_text),
            _whole,
            _whole,
        )
    ),
    **{kind: _one_of(*words) for kind, words in CHOICES.items()},
}
"""The check of each kind. A kind ending in "or null" also allows null."""


def holds(kind: str, value: object) -> bool:
    """Whether a value, as JSON gives it, is of a kind."""
    plain = kind.removesuffix(OR_NULL)
    return plain != kind if value is None else CHECKS[plain](value)
