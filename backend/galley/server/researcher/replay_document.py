"""A round as its replay page gets it: every state worked out here by the rules, sent as what changed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from galley.kitchen.events import decode
from galley.kitchen.trajectory import play
from galley.protocol.keyframes import RoundView, keyframe
from galley.protocol.scene import Scene, event_rows
from galley.records import RoundRow
from galley.records.reading.round_replay import nobody, trajectories_of

NO_HAT = "orange"


def replay_document(row: RoundRow, ticks: Mapping[int, Mapping[str, Any]], after: int = 0) -> dict[str, Any]:
    """The round for its page: fixed facts, a keyframe per episode, and each tick from `after` on.

    `ticks` are the stored rows by number. Keyframes and ticks are those of the play socket
    (docs/protocol.md); beside each tick stand both actions and why the agent's was not its own, if so.
    """
    trajectories = trajectories_of(row)
    layout = trajectories[0].layout
    scene = Scene(layout)
    view = _view(row)
    frames: list[dict[str, Any]] = []
    steps: list[dict[str, Any]] = []
    first, score = 0, 0
    for one in trajectories:
        replay = play(layout, one.joint_actions).to_its_end()
        board = keyframe(
            scene,
            view,
            replay.states[0],
            phase="ended",
            tick=0,
            episode=len(frames) + 1,
            score_before=score,
        )
        frames.append({"at": first, "board": board})
        for number in range(max(0, after - first), len(replay.out)):
            before, now, out = replay.states[number], replay.states[number + 1], replay.out[number]
            at = first + number
            changes = scene.changes(before, now)
            steps.append(
                {
                    "actions": row.joint_actions[at].tolist(),
                    "why": _why(ticks.get(at)),
                    **changes,
                    "score": score + changes["score"],
                    "events": event_rows(decode(layout, before, now, out)),
                }
            )
        first += len(replay.out)
        score += replay.score
    return {
        "status": row.status,
        "from": min(after, first),
        "ticks": first,
        "whole": row.horizon_ticks * row.episodes,
        "tick_ms": row.tick_ms,
        "score": score,
        "frames": frames,
        "steps": steps,
    }


def _view(row: RoundRow) -> RoundView:
    """The round as its first person saw it, though of the visit's other rounds nothing is known here."""
    first, second = row.seats
    human = next((seat.seat for seat in row.seats if seat.agent is None), 0)
    agents = any(seat.agent is not None for seat in row.seats)
    return RoundView(
        tick_ms=row.tick_ms,
        round_no=row.round_no,
        of=row.round_no,
        tutorial=row.round_no == 0,
        goal=None,
        episodes=row.episodes,
        seat=human,
        hats=(first.hat or NO_HAT, second.hat or NO_HAT),
        partner="none" if any(map(nobody, row.seats)) else "agent" if agents else "human",
    )


def _why(tick: Mapping[str, Any] | None) -> str | None:
    """Why the agent stayed although it decided nothing or something else; None for its own decision."""
    if tick is None:
        return None
    fault: str | None = tick["fault"]
    return fault or ("late" if tick["late"] else None)
