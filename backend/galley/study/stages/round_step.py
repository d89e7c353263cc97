"""A round as a visit's plan holds it: where, with whom, how long, and what if somebody is missing."""

from __future__ import annotations

from typing import Final, Literal, get_args

from pydantic import BaseModel, ConfigDict

from galley.study.visit.happenings import RoundEnded
from galley.study.visit.steps import Step

HUMAN: Final = "human"
"""Named as an agent: another participant."""

ALONE: Final = "none"
"""Named as a tutorial's agent: nobody is seen."""

ALONE_AGENT: Final = "stay"
"""The agent in the other seat of a tutorial alone; it is not drawn."""

InputMode = Literal["hold", "press"]
ShowScore = Literal["during", "after", "never"]
Partner = Literal["agent", "human", "none"]

Fallback = Literal["exit", "go_on"]
"""What may follow when nobody comes to play, besides an agent: the visit ends, or the round is left out."""

Dropout = Literal["end_round"]
"""What may follow when the other one leaves, besides an agent: the round ends."""

FALLBACKS: Final[tuple[Fallback, ...]] = get_args(Fallback)
DROPOUTS: Final[tuple[Dropout, ...]] = get_args(Dropout)


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True)


class Goal(_Part):
    """A score to aim for, and the line that tells it."""

    score: int
    text: str


class Bonus(_Part):
    """What reaching the goal earns."""

    amount: float
    unit: str


class LobbyRules(_Part):
    """How long another participant is waited for, and what follows when one is not there."""

    wait_s: int
    fallback: str
    """What follows then: one of `FALLBACKS`, or the name of the agent that plays."""
    dropout: str
    """What follows when the other one leaves: one of `DROPOUTS`, or the name of the agent that takes over."""

    @property
    def fallback_agent(self) -> str | None:
        """The agent that plays when nobody comes; None if none does."""
        return None if self.fallback in FALLBACKS else self.fallback

    @property
    def dropout_agent(self) -> str | None:
        """The agent that takes over when the other one leaves; None if the round ends."""
        return None if self.dropout in DROPOUTS else self.dropout

    @property
    def without_partner(self) -> Fallback | Literal["agent"]:
        """What follows when nobody comes, without the name of the agent that it may be."""
        return next((known for known in FALLBACKS if known == self.fallback), "agent")


class RoundStep(Step):
    """A round: `round_no` of the `of` that count, 0 for a tutorial.

    In a round with another participant there is no `agent`, but a `lobby`; two visits may play it together
    when their `pairing` is the same.
    """

    kind = "round"
    ended_by = (RoundEnded,)
    shown = (
        *("round_no", "of", "goal", "bonus", "human_hat", "partner_hat", "tutorial", "skippable"),
        *("partner", "episodes", "show_score", "input_mode"),
    )
    seldom = (*(name for name in Step.seldom if name != "skippable"), "lobby", "pairing")

    round_no: int
    of: int
    layout: str
    partner: Partner = "agent"
    agent: str | None
    human_seat: int
    human_hat: str
    partner_hat: str
    seed: int
    seeds: tuple[int, ...] = ()
    """Seeds of its episodes, the first of them `seed`; none in plans older than episodes."""
    episodes: int = 1
    ticks: int
    tick_ms: int
    input_mode: InputMode = "hold"
    show_score: ShowScore = "during"
    goal: Goal | None = None
    bonus: Bonus | None = None
    tutorial: bool = False
    scored: bool = True
    lobby: LobbyRules | None = None
    pairing: str = ""

    @property
    def seconds(self) -> float:
        """How long it is in play."""
        return self.episodes * self.ticks * self.tick_ms / 1000

    @property
    def agents(self) -> tuple[str, ...]:
        """Every agent that may play it, those that stand in for a person included."""
        stand_ins = () if self.lobby is None else (self.lobby.fallback_agent, self.lobby.dropout_agent)
        return tuple(agent for agent in (self.agent, *stand_ins) if agent is not None)
