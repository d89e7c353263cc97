"""What a film shows: a round's episodes run again, and how things stand at any moment of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from galley.errors import GalleyError
from galley.film.sizes import BOB_TILES, BUMP_MS, BUMP_TILES, EFFECT_MS, HATS, TOWARDS
from galley.kitchen.events import Event
from galley.kitchen.layout import Layout
from galley.kitchen.state import KitchenView, view
from galley.kitchen.trajectory import NOBODY, Replay, Trajectory, play

TICK_MS = 150
USUAL_HATS = ("blue", "orange")


@dataclass(frozen=True, eq=False)
class Footage:
    """A round to be filmed. `own` is the seat that gets the participant's ring, None for no ring.

    `drawn` are the seats whose chefs are seen.
    """

    episodes: tuple[Replay, ...]
    tick_ms: float = TICK_MS
    hats: tuple[str, str] = USUAL_HATS
    own: int | None = None
    drawn: tuple[int, ...] = (0, 1)

    @property
    def layout(self) -> Layout:
        """The kitchen, the same in all episodes."""
        return self.episodes[0].layout

    @property
    def ticks(self) -> int:
        """Ticks of all episodes together."""
        return sum(len(episode.out) for episode in self.episodes)


def footage(
    trajectories: Sequence[Trajectory],
    shown: str,
    tick_ms: float = TICK_MS,
    hats: Sequence[str | None] = (None, None),
) -> Footage:
    """What there is to film of the episodes of one round; `hats` by seat, None for a usual one.

    Raises:
        GalleyError: nothing of the round, which the message calls `shown`, was played.
    """
    seats = trajectories[0].seats
    drawn = tuple(seat for seat, who in enumerate(seats) if who.kind != NOBODY.kind)
    humans = [seat for seat, who in enumerate(seats) if who.kind == "human"]
    played = tuple(play(one.layout, one.joint_actions, one.initial).to_its_end() for one in trajectories)
    one, other = hats
    first = one if one in HATS else _spare(other)
    second = other if other in HATS else _spare(first)
    if not any(len(episode.out) for episode in played):
        raise GalleyError(f"{shown}: no tick was played, so there is nothing to draw")
    return Footage(played, tick_ms, (first, second), humans[0] if len(humans) == 1 else None, drawn)


def _spare(other: str | None) -> str:
    """A usual hat that the other chef does not wear."""
    return next(hat for hat in USUAL_HATS if hat != other)


@dataclass(frozen=True, slots=True)
class Moment:
    """The kitchen at one moment: where chefs are seen (tiles), how far above the floor, points that fly up.

    `points` are (x, y, words, share of their flight that is over).
    """

    kitchen: KitchenView
    seen: tuple[tuple[float, float], ...]
    lifts: tuple[float, ...]
    points: tuple[tuple[int, int, str, float], ...]
    score: int
    left_ms: float
    share_left: float


class Reel:
    """The moments of a footage by time."""

    def __init__(self, footage: Footage) -> None:
        self._footage = footage
        self._views = [[view(one.layout, state) for state in one.states] for one in footage.episodes]
        self._events: list[tuple[Event, ...]] = [one.events() for one in footage.episodes]
        self.length_ms = footage.ticks * footage.tick_ms

    def at(self, ms: float) -> Moment:
        """The kitchen `ms` after the start; the end of the round after its end."""
        episode, tick, share, before = self._place(ms)
        views, events = self._views[episode], self._events[episode]
        was, now = views[tick], views[min(tick + 1, len(views) - 1)]
        tick_ms = self._footage.tick_ms
        done = eased(share)
        seen, lifts = [], []
        for seat, (old, new) in enumerate(zip(was.chefs, now.chefs, strict=True)):
            x, y = old.x + (new.x - old.x) * done, old.y + (new.y - old.y) * done
            walks = (old.x, old.y) != (new.x, new.y)
            lifts.append(BOB_TILES * math.sin(math.pi * share) if walks else 0.0)
            hits = [e.tick for e in events if e.seat == seat and e.kind == "blocked" and e.tick <= tick]
            if hits:
                out = _bump((tick - hits[-1] + share) * tick_ms)
                dx, dy = TOWARDS[new.facing]
                x, y = x + dx * out, y + dy * out
            seen.append((x, y))
        horizon = self._footage.layout.rules.horizon_ticks
        left = max(0.0, horizon - now.tick + 1 - share) if tick + 1 < len(views) else horizon - now.tick
        points = tuple(
            (event.x, event.y, f"+{event.reward}" if event.reward else "0", flown)
            for event in events
            if event.kind == "delivery"
            and 0 <= (flown := ((tick - event.tick) + share) * tick_ms / EFFECT_MS) < 1
        )
        return Moment(
            now, tuple(seen), tuple(lifts), points, before + now.score, left * tick_ms, left / horizon
        )

    def _place(self, ms: float) -> tuple[int, int, float, int]:
        """Episode, tick of it, share of the tick that is over, and the score of the episodes before."""
        ticks = min(max(0.0, ms), self.length_ms) / self._footage.tick_ms
        before = 0
        for number, views in enumerate(self._views):
            length = len(views) - 1
            if ticks < length or number == len(self._views) - 1:
                break
            ticks -= length
            before += views[-1].score
        tick = min(int(ticks), length)
        return number, tick, ticks - tick, before


def eased(share: float) -> float:
    """How far a move is at a share of its tick, both 0 to 1; board.js draws it the same."""
    return 0.65 * share + 0.35 * share * share * (3 - 2 * share)


def _bump(ms: float) -> float:
    """How far a chef that ran against something is pushed out, in tiles."""
    share = min(1.0, ms / BUMP_MS)
    return math.sin(math.pi * share**0.7) * BUMP_TILES if share < 1 else 0.0
