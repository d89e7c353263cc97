"""What is fixed about a round before it is played, and what of it the browser is told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from galley.protocol.scene import Scene
from galley.server.rounds.episodes import Course
from galley.server.rounds.person import Person

END_ROUND: Final = "end_round"
"""What may follow a drop-out: the round ends. Anything else is the agent that takes the seat."""


@dataclass(frozen=True, slots=True)
class RoundSpec:
    """What is fixed about a round before it is played, besides its kitchen and who plays.

    `seeds` are those of the agent's episodes; `dropout` is what follows when one of two people does not come
    back: END_ROUND, or the name of the agent that takes the seat.
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
    partner: str = "agent"
    input_mode: str = "hold"
    show_score: str = "during"
    dropout: str = END_ROUND


def picture(spec: RoundSpec, scene: Scene, course: Course, phase: str, person: Person) -> dict[str, Any]:
    """The parts of a person's keyframe that the kitchen's state does not decide."""
    rules = course.layout.rules
    return {
        "phase": phase,
        "tick": course.kitchen.tick,
        "horizon": rules.horizon_ticks,
        "episode": course.episode,
        "episodes": course.episodes,
        "tick_ms": spec.tick_ms,
        "seat": person.seat,
        "hats": person.hats,
        "partner": spec.partner,
        "input_mode": spec.input_mode,
        "show_score": spec.show_score,
        "points": rules.delivery_reward,
        "grid": scene.grid,
        "cook_time": rules.cook_time_ticks,
        "goal": spec.goal,
        "round": spec.round_no,
        "of": spec.of,
        "tutorial": spec.tutorial,
    }
