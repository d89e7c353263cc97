"""What a match tells one of its people about the round as it stands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from galley.protocol.keyframes import keyframe
from galley.protocol.messages import Ended, Keyframe, Tick
from galley.protocol.scene import State, event_rows
from galley.server.rounds.person import Person

if TYPE_CHECKING:
    from galley.server.rounds.match import Match


def round_keyframe(match: Match, person: Person) -> Keyframe:
    """The whole of a round as one of its people sees it."""
    round_kitchen = match.round_kitchen
    return keyframe(
        match.scene,
        match.spec.view(person, round_kitchen.episodes),
        match.state,
        phase=match.phase,
        tick=round_kitchen.kitchen.tick,
        episode=round_kitchen.episode,
        score_before=round_kitchen.score_before,
    )


def round_tick(match: Match, before: State) -> Tick:
    """What the tick that was just played changed since the state `before` (int16 [S])."""
    kitchen = match.round_kitchen.kitchen
    return {
        "type": "tick",
        "tick": kitchen.tick,
        "events": event_rows(kitchen.events),
        **match.scene.changes(before, match.state, match.round_kitchen.score_before),
    }


def round_end(match: Match, person: Person) -> Ended:
    """How the round ended for a person: otherwise for who stayed than for who left."""
    stayed = bool(match.left) and person not in match.left
    outcome = "partner_left" if stayed else str(match.outcome)
    return {"type": "ended", "outcome": outcome, "score": match.round_kitchen.score, "next": person.next_url}
