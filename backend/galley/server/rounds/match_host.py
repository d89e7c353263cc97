"""What a match asks of whoever made it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from galley.outcomes import RoundOutcome
from galley.server.rounds.minds import Mind
from galley.server.rounds.person import Person

if TYPE_CHECKING:
    from galley.server.rounds.match import Match


class MatchHost(Protocol):
    """Stores what a match has come to, and finds stand-ins."""

    async def finish(self, match: Match, outcome: RoundOutcome) -> None:
        """Store the end; awaited once, before anybody is told."""

    async def stand_in(self, match: Match, person: Person, agent: str) -> Mind:
        """The agent of that name made ready for the seat of somebody who left, once that is stored."""

    def forget(self, match: Match) -> None:
        """Let go of it: nobody came, or another process has it."""

    def hidden(self, match: Match, person: Person, since_ms: float, until_ms: float | None) -> None:
        """Note that a person's page is out of sight, or was."""
