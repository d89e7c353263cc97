"""Handing a visit in to the recruiter in whose frame it ran: Amazon MTurk and its external questions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

MTURK: Final = ("https://www.mturk.com", "https://workersandbox.mturk.com")
"""Where workers hand in.

Source: MTurk API reference, ExternalQuestion: POST assignmentId and at least one more field to
{turkSubmitTo}/mturk/externalSubmit.
"""


def hand_in(params: Mapping[str, str], code: str | None) -> dict[str, Any] | None:
    """The form that hands a visit in, by the parameters that its link had; None without MTurk's."""
    place = params.get("turkSubmitTo", "").rstrip("/")
    assignment = params.get("assignmentId", "")
    if place not in MTURK or not assignment:
        return None
    return {
        "action": f"{place}/mturk/externalSubmit",
        "fields": {"assignmentId": assignment, "code": code or "none"},
    }
