"""What is fixed about a round before it is played."""

from __future__ import annotations

from dataclasses import dataclass

from galley.protocol.keyframes import RoundView
from galley.server.rounds.person import Person
from galley.study.stages.round_step import InputMode, Partner, ShowScore


@dataclass(frozen=True, slots=True)
class RoundSpec:
    """What is fixed about a round before it is played, besides its kitchen and who plays.

    `seeds` are those of the agent's episodes; `stand_in` is the agent that takes the seat when one of two
    people does not come back, None if the round ends then.
    """

    round_id: int
    tick_ms: int
    goal: int | None
    round_no: int
    of: int
    tutorial: bool
    countdown_s: int
    abandon_after_s: float
    seeds: tuple[int, ...] = (0,)
    partner: Partner = "agent"
    input_mode: InputMode = "hold"
    show_score: ShowScore = "during"
    stand_in: str | None = None

    def view(self, person: Person, episodes: int) -> RoundView:
        """What a person's page is told of it; `episodes` are those of the round."""
        return RoundView(
            tick_ms=self.tick_ms,
            round_no=self.round_no,
            of=self.of,
            tutorial=self.tutorial,
            goal=self.goal,
            episodes=episodes,
            seat=person.seat,
            hats=person.hats,
            partner=self.partner,
            input_mode=self.input_mode,
            show_score=self.show_score,
        )
