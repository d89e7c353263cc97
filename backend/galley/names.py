"""Names that people mistype: the nearest one there is, told as the fix of a problem."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

LISTED = 12
"""More names than this are not listed in full in a message."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most like `name`, or None if none is alike."""
    by_folded = {candidate.casefold(): candidate for candidate in known}
    found = difflib.get_close_matches(name.casefold(), by_folded, n=1, cutoff=0.6)
    return by_folded[found[0]] if found else None


def name_fix(name: object, known: Iterable[str]) -> str:
    """How to mend an unknown name: the nearest known one if there is one, and what there is."""
    names = sorted(known)
    if not names:
        return "there is none yet"
    shown = " ".join(names[:LISTED]) + (f" ... ({len(names)} in all)" if len(names) > LISTED else "")
    near = nearest(str(name), names)
    return f"use one of {shown}" if near is None else f"did you mean '{near}'? There is {shown}"
