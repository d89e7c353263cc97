"""Keyframes: the one place that puts them together, for a round in play and for its replay."""

from __future__ import annotations

from dataclasses import dataclass

from galley.protocol.messages import Keyframe
from galley.protocol.scene import Scene, State


@dataclass(frozen=True, slots=True)
class RoundView:
    """What a round's page is told that stays as it is while the round is played.

    `hats` are the colours of seat 0 and seat 1 as the participant at `seat` sees them; `goal` are the points
    that earn the bonus.
    """

    tick_ms: int
    round_no: int
    of: int
    tutorial: bool
    goal: int | None
    episodes: int
    seat: int
    hats: tuple[str, str]
    partner: str = "agent"
    input_mode: str = "hold"
    show_score: str = "during"


def keyframe(
    scene: Scene,
    view: RoundView,
    state: State,
    *,
    phase: str,
    tick: int,
    episode: int,
    score_before: int = 0,
) -> Keyframe:
    """The whole of a round in a state (int16 [S]); `score_before` are the points of earlier episodes."""
    rules = scene.layout.rules
    return {
        "type": "keyframe",
        "phase": phase,
        "tick": tick,
        "horizon": rules.horizon_ticks,
        "episode": episode,
        "episodes": view.episodes,
        "tick_ms": view.tick_ms,
        "seat": view.seat,
        "hats": list(view.hats),
        "partner": view.partner,
        "input_mode": view.input_mode,
        "show_score": view.show_score,
        "points": rules.delivery_reward,
        "grid": scene.grid,
        "cook_time": rules.cook_time_ticks,
        "goal": view.goal,
        "round": view.round_no,
        "of": view.of,
        "tutorial": view.tutorial,
        **scene.whole(state, score_before),
    }
