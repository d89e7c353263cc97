"""What the page of somebody who waits for a partner is told; galley.records.store.pairing pairs them."""

from __future__ import annotations

import asyncio
import math
from dataclasses import dataclass
from typing import Final
from weakref import WeakValueDictionary

from galley.outcomes import VisitOutcome
from galley.records import Store
from galley.records.store import queries
from galley.records.store.pairing import Waits
from galley.server.clock import Clock
from galley.server.participant.visits import Visit, Visits
from galley.server.rounds.matches import Matches
from galley.study.stages.round_step import LobbyRules, RoundStep
from galley.study.visit.happenings import Ended, RoundEnded

GONE_S: Final = 15.0
"""Who asked last so long ago does not wait any more; pages ask every few seconds."""


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


class Lobby:
    """Asks the records to pair who waits, and sees to those for whom nobody comes.

    Who waits is in the records, where one process at a time pairs two of them, whichever they came to. Two
    visits fit when the study, the `pairing` of their steps and whether they are tests are the same. Who
    waited longest goes first and gets the seat of their plan. Who waits too long meets the round's fallback.
    """

    def __init__(self, store: Store, matches: Matches, visits: Visits, clock: Clock) -> None:
        self._store = store
        self._matches = matches
        self._visits = visits
        self._clock = clock
        self._locks: WeakValueDictionary[int, asyncio.Lock] = WeakValueDictionary()

    async def see(self, visit: Visit) -> Meeting:
        """How it stands with the round of a participant who asks just now; they are paired if they can be."""
        async with self._lock(visit):
            begun = await self._begun(visit)
            if begun is not None:
                return begun
            found = await asyncio.wrap_future(
                self._store.wait_for_partner(_waits(visit), GONE_S, self._matches.together)
            )
            if found is not None:
                return await self._begun(visit) or Meeting(waiting=False, begun=True)
            waited_s = visit.spent_s(self._clock.ms())
            left_s = _rules(visit).wait_s - waited_s
            if left_s <= 0:
                return await self._fall_back(visit)
            return Meeting(waiting=True, seconds_left=math.ceil(left_s), waited_s=int(waited_s))

    async def leave(self, visit: Visit) -> None:
        """Somebody does not want to wait any longer: what follows nobody coming follows at once."""
        async with self._lock(visit):
            if await self._begun(visit) is None:
                await self._fall_back(visit)

    async def _begun(self, visit: Visit) -> Meeting | None:
        if not await self._matches.begun(visit):
            return None
        return Meeting(waiting=False, begun=True, alone=await self._matches.with_agent(visit))

    async def _fall_back(self, visit: Visit) -> Meeting:
        paired = await asyncio.wrap_future(self._store.stop_waiting(visit.row.id, visit.step.id))
        if paired is not None:
            return await self._begun(visit) or Meeting(waiting=False, begun=True)
        rules = _rules(visit)
        if rules.fallback_agent is not None:
            await self._matches.set_up(visit, rules.fallback_agent)
            return Meeting(waiting=False, begun=True, alone=True)
        if rules.without_partner == "exit":
            outcome: VisitOutcome = "partner_lost" if await self._met_somebody(visit) else "partner_missing"
            await self._visits.happened(visit, Ended(visit.step.id, outcome))
        else:
            await self._visits.happened(visit, RoundEnded(visit.step.id, "abandoned"))
        return Meeting(waiting=False)

    async def _met_somebody(self, visit: Visit) -> bool:
        """Whether the visit was in a round with another person before the one it is at."""
        steps = visit.plan.steps[: visit.progress.step_index]
        before = [step.id for step in steps if isinstance(step, RoundStep) and step.partner == "human"]

        met = self._store.read(lambda connection: queries.met_somebody(connection, visit.row.id, before))
        return await asyncio.wrap_future(met)

    def _lock(self, visit: Visit) -> asyncio.Lock:
        return self._locks.setdefault(visit.row.id, asyncio.Lock())


def _rules(visit: Visit) -> LobbyRules:
    """What the visit's plan says of waiting.

    Raises:
        ValueError: nobody is to be waited for at the visit's step.
    """
    if visit.round is None or visit.round.lobby is None:
        raise ValueError(f"step '{visit.step.id}' has no lobby")
    return visit.round.lobby


def _waits(visit: Visit) -> Waits:
    pairing = "" if visit.round is None else visit.round.pairing
    return Waits(visit.row.id, visit.step.id, visit.progress.step_index, pairing)
