"""The live rounds of a serving process: set up, found again, taken over where a journal ends, closed."""

from __future__ import annotations

import asyncio
import json
import logging
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from weakref import WeakValueDictionary

from galley.agents.catalogue import Catalogue
from galley.kitchen import Layout
from galley.outcomes import RoundOutcome
from galley.protocol.messages import CLOSE_ENDED
from galley.records import Lease, NewRound, RoundRow, Store, VisitRow
from galley.records.database import leases
from galley.records.reading.round_replay import state_bytes
from galley.records.store import queries
from galley.server.clock import Clock, Stagger
from galley.server.participant.visits import Visit, Visits
from galley.server.rounds.match import Match
from galley.server.rounds.minds import Mind, ready_agent
from galley.server.rounds.person import Person
from galley.server.rounds.round_journal import RoundJournal
from galley.server.rounds.round_kitchen import RoundKitchen, caught_up
from galley.server.rounds.round_spec import RoundSpec
from galley.server.rounds.set_up import of_one, of_two, round_at
from galley.server.rounds.thinking import ThinkingThreads
from galley.study.visit.happenings import RoundEnded

LOG = logging.getLogger(__name__)
LEASE_S = 10.0
"""How long a round stays with a process that gives no sign of life."""


class RoundBusy(Exception):
    """The round is played at another serving process, which lives: the browser has to get there.

    `address` is where that process is reached, "" if nobody knows.
    """

    def __init__(self, round_id: int, address: str) -> None:
        super().__init__(f"round {round_id} is played at another server")
        self.address = address


@dataclass(frozen=True, slots=True)
class Place:
    """A participant's place in a live round."""

    match: Match
    person: Person


@dataclass(slots=True)
class _Live:
    """A match with the visits of its people, by seat, as far as they came here."""

    match: Match
    row: RoundRow
    visits: dict[int, Visit] = field(default_factory=dict)


class Matches:
    """One match per round, made when the first of its people connects; keeps what each of them asks for.

    A round belongs to one serving process at a time, by a lease in the records. A person who plays with an
    agent and connects here takes the round along from wherever it was. A round of two people is only taken
    once the process that had it is gone, for both must meet in one process. `address` is where other
    processes reach this one.
    """

    def __init__(
        self,
        store: Store,
        visits: Visits,
        catalogue: Catalogue,
        layouts: Mapping[str, Layout],
        thinking: ThinkingThreads,
        clock: Clock,
        address: str = "",
    ) -> None:
        self._address = address or None
        self._store = store
        self._visits = visits
        self._catalogue = catalogue
        self._layouts = layouts
        self._thinking = thinking
        self._clock = clock
        self._stagger = Stagger()
        self._owner = secrets.token_hex(8)
        # A database in a file has one serving process, so that nobody else can have its rounds.
        self._only_server = store.engine.dialect.name == "sqlite"
        self._live: dict[int, _Live] = {}
        # Layouts and all that is derived from them are shared by the rounds played on them.
        self._known: dict[Layout, Layout] = {}
        self._round_of: dict[int, tuple[str, int]] = {}
        self._locks: WeakValueDictionary[tuple[str, int], asyncio.Lock] = WeakValueDictionary()

    def __len__(self) -> int:
        return len(self._live)

    def playing(self) -> bool:
        """Whether a round is in play, or about to be."""
        return any(live.match.phase in ("countdown", "playing") for live in self._live.values())

    async def of(self, visit: Visit) -> Place | None:
        """The place in the round that a visit is at; None when it is at none, or its round is over already.

        Raises:
            RoundBusy: another process has the round and keeps it.
        """
        step = visit.round
        if not visit.active or step is None:
            return None
        there = self._place(visit)
        if there is not None:
            return there
        async with self._lock("visit", visit.row.id):
            row = await self._row(visit)
            if row is None and step.agent is not None:
                await self.set_up(visit, step.agent)
                row = await self._row(visit)
        if row is None:
            return None
        async with self._lock("round", row.id):
            there = self._place(visit)
            if there is None:
                there = await self._take_up(visit, row.id)
        return there

    @property
    def owner(self) -> str:
        """The name under which this process leases rounds."""
        return self._owner

    def in_play(self, visit: Visit) -> bool:
        """Whether a visit's round runs here just now, with everybody there."""
        place = self._place(visit)
        return place is not None and place.match.phase in ("countdown", "playing")

    async def begun(self, visit: Visit) -> bool:
        """Whether the round that a visit is at was set up."""
        return self._place(visit) is not None or await self._glance(visit) is not None

    async def with_agent(self, visit: Visit) -> bool:
        """Whether the round that a visit is at was set up with an agent."""
        row = await self._glance(visit)
        return row is not None and _with_agent(row)

    async def skip(self, visit: Visit) -> bool:
        """Whether the round a visit is at was skipped; only some may be."""
        step = visit.round
        if step is None or not step.skippable:
            return False
        if not await self.begun(visit) and step.partner == "human":
            return await self._visits.happened(visit, RoundEnded(step.id, "skipped"))
        place = await self.of(visit)
        if place is None:
            return False
        await self._leave(visit, place, "skipped")
        return True

    async def give_up(self, visit: Visit) -> None:
        """End the round a visit is at, if it has begun, as abandoned: the visit's time is over."""
        if await self.begun(visit):
            place = await self.of(visit)
            if place is not None:
                await self._leave(visit, place, "abandoned")

    async def _leave(self, visit: Visit, place: Place, outcome: RoundOutcome) -> None:
        """End the round for one person, who alone decides about it when they play with an agent."""
        if len(place.match.people) == 1:
            place.match.end(outcome)
            await place.match.ended()
            return
        place.match.drop_out(place.person)
        await self._visits.happened(visit, RoundEnded(visit.step.id, outcome))

    async def stop(self) -> None:
        """Stop every match for a shutdown: all that was played is journalled, rounds that are over closed.

        Other processes may have the rounds at once.
        """
        for live in tuple(self._live.values()):
            live.match.stop()
            live.match.stop_minds()
            await live.match.ended()
            lease = live.match.journal.lease
            if lease is not None and live.match.phase != "ended":
                await asyncio.wrap_future(self._store.release(lease))

    async def stop_visit(self, visit_id: int) -> None:
        """Stop the match of a visit that is to be erased, if it has one; the round's end is not written."""
        live = self._live.get(self._round_of.get(visit_id, ("", 0))[1])
        if live is None:
            return
        match = live.match
        for person in match.people:
            connection = person.connection
            if connection is not None:
                connection.close(CLOSE_ENDED)
                match.leave(connection)
        match.stop()
        await match.ended()
        self.forget(match)
        await asyncio.wrap_future(self._store.flush())

    # ---- setting up ----------------------------------------------------------------------------------------

    async def set_up(self, visit: Visit, agent: str) -> int:
        """The id of the round of a visit's step, set up with an agent."""
        bundle = self._catalogue.bundle(agent)
        sits = visit.row.id, round_at(visit)
        new = of_one(self._layouts, *sits, bundle.name, bundle.sha256, self._clock.ms())
        return await asyncio.wrap_future(self._store.set_up_round(new))

    def together(self, first: VisitRow, second: VisitRow) -> NewRound:
        """The round that two visits play at their steps; for the writer's thread."""
        return of_two(self._layouts, first, second, self._clock.ms())

    async def _glance(self, visit: Visit) -> RoundRow | None:
        """The round as far as it is committed, without troubling the writer: pages ask often."""
        at_step = visit.row.id, visit.step.id
        return await asyncio.wrap_future(
            self._store.read(lambda connection: queries.round_of(connection, *at_step))
        )

    async def _row(self, visit: Visit) -> RoundRow | None:
        return await asyncio.wrap_future(self._store.open_round(visit.row.id, visit.step.id))

    async def _take_up(self, visit: Visit, round_id: int) -> Place | None:
        """The round as this process's own, its kitchen and agents as the journal leaves them."""
        live = self._live.get(round_id)
        if live is None:
            lease = await self._lease(visit, round_id)
            row = await self._row(visit)
            outcome = "abandoned" if row is None else _over(row, visit)
            if row is None or outcome is not None:
                if lease is not None:
                    await asyncio.wrap_future(self._store.release(lease))
                # The server stopped between closing the round and moving on, or the seat was given away.
                await self._visits.happened(visit, RoundEnded(visit.step.id, outcome or "abandoned"))
                return None
            live = self._live[round_id] = _Live(await self._make(visit, row, lease), row)
            if _erased(row):
                live.match.end("abandoned")
        return self._seat(visit, live)

    async def _lease(self, visit: Visit, round_id: int) -> Lease | None:
        """The right to write the round; None where no other process could have it."""
        if self._only_server:
            return None
        steal = round_at(visit).partner != "human"
        lease = await asyncio.wrap_future(
            self._store.lease_round(round_id, self._owner, LEASE_S, steal=steal, address=self._address)
        )
        if lease is None:
            where = self._store.read(lambda connection: leases.address(connection, round_id) or "")
            raise RoundBusy(round_id, await asyncio.wrap_future(where))
        return lease

    def _seat(self, visit: Visit, live: _Live) -> Place | None:
        seat = next((seat.seat for seat in live.row.seats if seat.visit_id == visit.row.id), None)
        person = next((one for one in live.match.people if one.seat == seat), None)
        if person is None:
            return None
        step = round_at(visit)
        own, other = step.human_hat, step.partner_hat
        person.hats = (own, other) if seat == 0 else (other, own)
        person.next_url = visit.url
        live.visits[person.seat] = visit
        self._round_of[visit.row.id] = (visit.step.id, live.row.id)
        return Place(live.match, person)

    def _place(self, visit: Visit) -> Place | None:
        step_id, round_id = self._round_of.get(visit.row.id, ("", 0))
        live = self._live.get(round_id)
        if live is None or step_id != visit.step.id:
            return None
        if live.match.journal.lost:
            live.match.lose()
            return None
        return self._seat(visit, live)

    async def _make(self, visit: Visit, row: RoundRow, lease: Lease | None) -> Match:
        step, config = round_at(visit), visit.study.config
        drawn = Layout.from_dict(json.loads(row.layout_json))
        layout = self._known.setdefault(drawn, drawn)
        seeds = step.seeds if step.seeds and step.seed == row.seed else (row.seed,) * row.episodes
        spec = RoundSpec(
            round_id=row.id,
            tick_ms=row.tick_ms,
            goal=None if step.goal is None else step.goal.score,
            round_no=row.round_no,
            of=step.of,
            tutorial=step.tutorial,
            countdown_s=config.countdown_s,
            abandon_after_s=config.abandon_after_s,
            seeds=seeds,
            partner="agent" if _with_agent(row) and step.partner == "human" else step.partner,
            input_mode=step.input_mode,
            show_score=step.show_score,
            stand_in=None if step.lobby is None else step.lobby.dropout_agent,
        )
        catch_up = self._thinking.kitchens.do(lambda: caught_up(layout, row.episodes, row.joint_actions))
        round_kitchen = await asyncio.wrap_future(catch_up)
        players: list[Person | Mind] = []
        stood_in = {one.seat: one for one in row.stand_ins}
        for seat in row.seats:
            who = stood_in.get(seat.seat, seat)
            if who.agent is not None:
                players.append(
                    await self._mind(who.agent, who.agent_sha256, round_kitchen, seat.seat, spec, row)
                )
            else:
                repeats = spec.input_mode == "hold"
                players.append(Person(seat.seat, seat.visit_id or 0, ("", ""), visit.url, repeats=repeats))
        return Match(
            spec,
            round_kitchen,
            (players[0], players[1]),
            RoundJournal(self._store, self._clock, row.id, lease),
            self._clock,
            self,
            stagger=self._stagger.phase(),
        )

    async def _mind(
        self,
        name: str,
        sha256: str | None,
        round_kitchen: RoundKitchen,
        seat: int,
        spec: RoundSpec,
        row: RoundRow,
    ) -> Mind:
        bundle = self._catalogue.bundle(name)
        if bundle.sha256 != sha256:
            LOG.warning("round %d goes on with another version of agent %s", row.id, name)
        # What the kitchen has come to is read now: a slow agent looks at it while the round goes on.
        seen = row.joint_actions[len(row.joint_actions) - round_kitchen.kitchen.tick :]
        ready = partial(
            ready_agent, bundle, round_kitchen.layout, seat, spec.seeds[round_kitchen.episode - 1], seen
        )
        return await self._thinking.mind(bundle, ready)

    # ---- what a match asks for -----------------------------------------------------------------------------

    async def finish(self, match: Match, outcome: RoundOutcome) -> None:
        """Store the end of a round and move its people on."""
        round_kitchen = match.round_kitchen
        live = self._live.get(match.spec.round_id)
        try:
            await asyncio.wrap_future(
                self._store.finish_round(
                    match.spec.round_id,
                    outcome,
                    round_kitchen.score,
                    round_kitchen.deliveries,
                    self._clock.ms(),
                    state_bytes(round_kitchen.last_state),
                    lease=match.journal.lease,
                )
            )
            for person in match.people:
                visit = None if live is None else live.visits.get(person.seat)
                if visit is not None:
                    await self._visits.happened(visit, RoundEnded(visit.step.id, outcome))
        finally:
            self.forget(match)

    async def stand_in(self, match: Match, person: Person, agent: str) -> Mind:
        """An agent for the seat of somebody who left, whose visit goes on without the round."""
        live = self._live[match.spec.round_id]
        bundle = self._catalogue.bundle(agent)
        now_ms = self._clock.ms()
        await asyncio.wrap_future(
            self._store.stand_in(
                match.spec.round_id,
                person.seat,
                match.round_kitchen.ticks,
                bundle.name,
                bundle.sha256,
                now_ms,
                match.journal.lease,
            )
        )
        visit = live.visits.pop(person.seat, None)
        self._round_of.pop(person.visit_id, None)
        if visit is not None:
            await self._visits.happened(visit, RoundEnded(visit.step.id, "abandoned"))
            row = await self._row(visit)
        else:
            row = await self._row(next(iter(live.visits.values())))
        live.row = row or live.row
        return await self._mind(
            bundle.name, bundle.sha256, match.round_kitchen, person.seat, match.spec, live.row
        )

    def forget(self, match: Match) -> None:
        """Let go of a match; the next connection makes it anew from the journal."""
        match.stop_minds()
        live = self._live.get(match.spec.round_id)
        if live is None or live.match is not match:
            return
        del self._live[match.spec.round_id]
        if match.journal.lease is not None and match.phase != "ended":
            self._store.release(match.journal.lease)
        for visit_id, (_, round_id) in tuple(self._round_of.items()):
            if round_id == match.spec.round_id:
                del self._round_of[visit_id]

    def hidden(self, match: Match, person: Person, since_ms: float, until_ms: float | None) -> None:
        """Note that a person's page is out of sight, or was."""
        live = self._live.get(match.spec.round_id)
        visit = None if live is None else live.visits.get(person.seat)
        if visit is not None:
            self._store.hidden(visit.row.id, visit.step.id, since_ms, until_ms)

    # ---- small parts ---------------------------------------------------------------------------------------

    def _lock(self, what: str, number: int) -> asyncio.Lock:
        return self._locks.setdefault((what, number), asyncio.Lock())


def _with_agent(row: RoundRow) -> bool:
    return any(seat.agent is not None for seat in row.seats)


def _over(row: RoundRow, visit: Visit) -> RoundOutcome | None:
    """How the round ended for a visit; None while it may be played."""
    if row.status != "open":
        return row.status
    mine = next(seat.seat for seat in row.seats if seat.visit_id == visit.row.id)
    return "abandoned" if any(one.seat == mine for one in row.stand_ins) else None


def _erased(row: RoundRow) -> bool:
    """Whether somebody of the round was erased from the records."""
    return any(seat.visit_id is None and seat.agent is None for seat in row.seats)
