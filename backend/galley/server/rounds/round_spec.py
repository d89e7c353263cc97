"""What is fixed about a round before it is played, and what of it the browser is told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from galley.protocol.scene import Scene
from galley.server.rounds.episodes import Course
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
