"""What may happen in a visit; each names the step that it belongs to."""

from __future__ import annotations

from dataclasses import dataclass

from galley.outcomes import RoundOutcome, VisitOutcome


@dataclass(frozen=True)
class Agreed:
    """The participant agreed to the consent text."""

    step_id: str


@dataclass(frozen=True)
class Declined:
    """The participant declined; the visit ends."""

    step_id: str


@dataclass(frozen=True)
class Submitted:
    """Answers without a problem arrived (`validate_answers` comes before)."""

    step_id: str


@dataclass(frozen=True)
class Continued:
    """The participant has read a text or rested and goes on."""

    step_id: str


@dataclass(frozen=True)
class Skipped:
    """The participant leaves out a step that may be left out."""

    step_id: str


@dataclass(frozen=True)
class TimedOut:
    """The step's time limit has passed."""

    step_id: str


@dataclass(frozen=True)
class RoundEnded:
    """A round is over: played to its end, left for too long, or (where allowed) skipped."""

    step_id: str
    outcome: RoundOutcome


@dataclass(frozen=True)
class Ended:
    """The visit ends for a reason outside its steps: too long in all, slot given away, partner missing."""

    step_id: str
    outcome: VisitOutcome


Happening = Agreed | Declined | Submitted | Continued | Skipped | TimedOut | RoundEnded | Ended
