"""Where people wait for somebody to play with: pairs them, and sees to those for whom nobody comes."""

from __future__ import annotations

import asyncio
import math
from dataclasses import dataclass
from typing import Final

from galley.server.clock import Clock
from galley.server.matches import Matches
from galley.server.visits import Visit, Visits
from galley.study.progress import Ended, RoundEnded

GONE_S: Final = 15.0
"""Who asked last so long ago does not wait any more; pages ask every few seconds."""

EXIT, GO_ON = "exit", "go_on"


@dataclass(frozen=True, slots=True)
class Meeting:
    """How it stands with somebody's round: `waiting`, or `begun`, or neither when it is left out or over.

    `alone` says that an agent plays after all.
    """

    waiting: bool
    begun: bool = False
    alone: bool = False
    seconds_left: int = 0
    waited_s: int = 0


@dataclass(slots=True)
class _Waiting:
    visit: Visit
    since_s: float
    asked_s: float


class Lobby:
    """Pairs people who wait in this process for the same round of the same study.

    Two visits fit when the study, the `pairing` of their steps and whether they are tests are the same. Who
    waited longest goes first and gets the seat of their plan. Who waits too long meets the round's fallback.
    """

    def __init__(self, matches: Matches, visits: Visits, clock: Clock) -> None:
        self._matches = matches
        self._visits = visits
        self._clock = clock
        self._waiting: dict[int, _Waiting] = {}
        self._pairing = asyncio.Lock()

    def __len__(self) -> int:
        return len(self._waiting)

    async def see(self, visit: Visit) -> Meeting:
        """How it stands with the round of a participant who asks just now; they are paired if they can be."""
        async with self._pairing:
            begun = await self._begun(visit)
            if begun is not None:
                return begun
            now_s = self._clock.now()
            there = self._waiting.get(visit.row.id)
            since_s = now_s if there is None else there.since_s
            self._waiting[visit.row.id] = _Waiting(visit, since_s, now_s)
            other = await self._other(visit, now_s)
            if other is not None:
                first, second = (other, visit) if self._came_before(other, visit) else (visit, other)
                await self._matches.set_up(first, "", also=second)
                for one in (first, second):
                    self._waiting.pop(one.row.id, None)
                return Meeting(waiting=False, begun=True)
            waited_s = visit.spent_s(self._clock.ms())
            left_s = visit.step.data["lobby"]["wait_s"] - waited_s
            if left_s <= 0:
                return await self._fall_back(visit)
            return Meeting(waiting=True, seconds_left=math.ceil(left_s), waited_s=int(waited_s))

    async def leave(self, visit: Visit) -> None:
        """Somebody does not want to wait any longer: what follows nobody coming follows at once."""
        async with self._pairing:
            if await self._begun(visit) is None:
                await self._fall_back(visit)

    async def _begun(self, visit: Visit) -> Meeting | None:
        if not await self._matches.begun(visit):
            return None
        self._waiting.pop(visit.row.id, None)
        return Meeting(waiting=False, begun=True, alone=await self._matches.with_agent(visit))

    async def _other(self, visit: Visit, now_s: float) -> Visit | None:
        """Who waited longest of those that fit, as their visit is now."""
        for waiting in sorted(self._waiting.values(), key=lambda waiting: waiting.since_s):
            if now_s - waiting.asked_s > GONE_S:
                del self._waiting[waiting.visit.row.id]
            elif _fit(visit, waiting.visit):
                found = await self._visits.find(waiting.visit.row.token)
                if found is not None and found.active and found.step.id == waiting.visit.step.id:
                    return found
                del self._waiting[waiting.visit.row.id]
        return None

    def _came_before(self, one: Visit, other: Visit) -> bool:
        return self._waiting[one.row.id].since_s <= self._waiting[other.row.id].since_s

    async def _fall_back(self, visit: Visit) -> Meeting:
        self._waiting.pop(visit.row.id, None)
        fallback = visit.step.data["lobby"]["fallback"]
        if fallback == EXIT:
            await self._visits.happened(visit, Ended(visit.step.id, "partner_missing"))
        elif fallback == GO_ON:
            await self._visits.happened(visit, RoundEnded(visit.step.id, "abandoned"))
        else:
            await self._matches.set_up(visit, fallback)
            return Meeting(waiting=False, begun=True, alone=True)
        return Meeting(waiting=False)


def _fit(one: Visit, other: Visit) -> bool:
    same = all(
        mine == theirs
        for mine, theirs in (
            (one.row.study, other.row.study),
            (one.row.study_sha256, other.row.study_sha256),
            (one.row.test, other.row.test),
            (one.step.data["pairing"], other.step.data["pairing"]),
        )
    )
    return same and one.row.id != other.row.id
