"""How numbers, times and answers are shown on the researcher's pages."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any, Final

DASH = "–"
MINUTE_S = 60
HOUR_S = 3600


def when(at_ms: float | None) -> str:
    """A time as UTC date and time to the second."""
    return DASH if at_ms is None else f"{datetime.fromtimestamp(at_ms / 1000, UTC):%Y-%m-%d %H:%M:%S}"


def iso(at_ms: float | None) -> str:
    """The same for machines."""
    return "" if at_ms is None else datetime.fromtimestamp(at_ms / 1000, UTC).isoformat()


def lasting(seconds: float | None) -> str:
    """A length of time in two units at most."""
    if seconds is None:
        return DASH
    whole = max(0, round(seconds))
    if whole < MINUTE_S:
        return f"{whole} s"
    if whole < HOUR_S:
        return f"{whole // MINUTE_S} min {whole % MINUTE_S:02d} s"
    return f"{whole // HOUR_S} h {whole % HOUR_S // MINUTE_S:02d} min"


def answer(value: Any) -> str:
    """A stored answer as text."""
    if value is None:
        return DASH
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def words(name: str) -> str:
    """A status or kind as words."""
    return name.replace("_", " ")


def cell(condition: dict[str, Any]) -> str:
    """A cell of the design in words."""
    return ", ".join(f"{factor}: {answer(level)}" for factor, level in condition.items()) or "all"


FILTERS: Final[Mapping[str, Callable[[Any], str]]] = {
    "when": when,
    "iso": iso,
    "lasting": lasting,
    "answer": answer,
    "words": words,
    "cell": cell,
}
"""What the templates call them by."""
