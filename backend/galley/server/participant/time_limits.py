"""What the passing of time does to visits: on their pages, and by the clock for those that load none."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from typing import Final

from galley.errors import GalleyError
from galley.records import Store
from galley.records.reading.overdue import overdue_tokens
from galley.server.clock import Clock
from galley.server.participant.visits import GRACE_S, Visit, Visits
from galley.server.rounds.matches import Matches, RoundBusy
from galley.study.study import Study
from galley.study.visit.happenings import Ended, Happening

LOG = logging.getLogger(__name__)
LOOK_EVERY_S: Final = 2.0


async def time_is_up(visits: Visits, matches: Matches, visit: Visit, happening: Happening) -> None:
    """Let a limit that has passed do to a visit what it does.

    A round that is being played is played to its end first: its partner, who may be a person, has done
    nothing wrong, and what is stored is whole. One that waits or stands still ends as abandoned.
    """
    if isinstance(happening, Ended) and visit.round is not None:
        try:
            if matches.in_play(visit):
                return
            await matches.give_up(visit)
        except RoundBusy:  # whoever has the round watches the time too
            return
        visit = await visits.find(visit.row.token) or visit
        happening = Ended(visit.step.id, happening.outcome)
    await visits.happened(visit, happening)


class TimeLimits:
    """Ends visits whose time has passed though nobody loads their page, so that their slots return."""

    def __init__(
        self, store: Store, studies: Mapping[str, Study], visits: Visits, matches: Matches, clock: Clock
    ) -> None:
        limits = {name: study.config.visit_limit_min for name, study in studies.items()}
        self._limits_ms = {name: 60_000.0 * limit for name, limit in limits.items() if limit is not None}
        self._store = store
        self._visits = visits
        self._matches = matches
        self._clock = clock

    async def watch(self) -> None:
        """Look again and again, until cancelled."""
        while self._limits_ms:
            await asyncio.sleep(LOOK_EVERY_S)
            try:
                await self.look()
            except GalleyError as error:  # the database is away; whoever comes meanwhile is told
                LOG.warning("time limits wait: %s", error)
            except Exception:
                LOG.exception("time limits could not be kept this time")

    async def look(self) -> None:
        """End every visit whose time has passed, but those in rounds that another process plays."""
        now_ms = self._clock.ms() - GRACE_S * 1000.0
        begun_before = {name: now_ms - limit_ms for name, limit_ms in self._limits_ms.items()}
        owner = self._matches.owner
        tokens = await asyncio.wrap_future(
            self._store.read(lambda connection: overdue_tokens(connection, begun_before, owner))
        )
        for token in tokens:
            visit = await self._visits.find(token)
            happening = None if visit is None else self._visits.overdue(visit, GRACE_S)
            if visit is not None and isinstance(happening, Ended):
                await time_is_up(self._visits, self._matches, visit, happening)
