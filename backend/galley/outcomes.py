"""How rounds and visits end: the words that plans, messages, records and pages share."""

from __future__ import annotations

from typing import Final, Literal, get_args

RoundOutcome = Literal["finished", "abandoned", "skipped"]
ROUND_OUTCOMES: Final[tuple[RoundOutcome, ...]] = get_args(RoundOutcome)
"""How a round may end."""

RoundStatus = Literal["open"] | RoundOutcome
ROUND_STATUSES: Final[tuple[RoundStatus, ...]] = ("open", *ROUND_OUTCOMES)

VisitOutcome = Literal[
    "completed",
    "declined",
    "screened_out",
    "failed_checks",
    "timed_out",
    "expired",
    "partner_missing",
    "partner_lost",
    "interrupted",
]
VISIT_OUTCOMES: Final[tuple[VisitOutcome, ...]] = get_args(VisitOutcome)
"""How a visit may end."""

ENDED_FROM_OUTSIDE: Final[tuple[VisitOutcome, ...]] = (
    "timed_out",
    "expired",
    "partner_missing",
    "partner_lost",
    "interrupted",
)
"""How a visit may end wherever it is."""

NoRoom = Literal["full", "later", "paused", "closed"]
"""Why a study takes nobody: all slots completed, all taken just now, or its researcher's word."""

TurnedAway = NoRoom | Literal["uninvited", "incomplete"]
"""Why somebody cannot begin; a link is `incomplete` without the id that the recruiter should fill in."""

VisitStatus = Literal["active"] | VisitOutcome
VISIT_STATUSES: Final[tuple[str, ...]] = ("active", *VISIT_OUTCOMES, "abandoned")
"""What the records may say of a visit; `abandoned` stands in old databases only."""
