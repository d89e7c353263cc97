"""The live rounds of a serving process: set up, found again, taken up where a journal ends, closed."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Mapping
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from galley.agents.catalogue import Catalogue
from galley.agents.protocol import Agent
from galley.kitchen import Kitchen, Layout
from galley.records import RoundRow, Store
from galley.server import wire
from galley.server.clock import Clock, Stagger
from galley.server.journal import RoundJournal
from galley.server.match import Match, RoundSpec
from galley.server.thinking import Mind, Thinking
from galley.server.visits import Visit, Visits
from galley.study.plan import Step
from galley.study.progress import RoundEnded

LOG = logging.getLogger(__name__)


class Unable:
    """Stands in for an agent that could not be made ready: each decision is a fault, so it stays."""

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Nothing to begin."""

    def act(self, state: NDArray[np.int16], tick: int) -> int:
        """Never an action. Raises: RuntimeError."""
        raise RuntimeError("the agent could not be made ready for this round")

    def observe(self, state: NDArray[np.int16], joint_action: tuple[int, int]) -> None:
        """Nothing to note."""


class Matches:
    """One match per visit that is at a round, made when its page first connects."""

    def __init__(
        self,
        store: Store,
        visits: Visits,
        catalogue: Catalogue,
        layouts: Mapping[str, Layout],
        thinking: Thinking,
        clock: Clock,
    ) -> None:
        self._store = store
        self._visits = visits
        self._catalogue = catalogue
        self._layouts = layouts
        self._thinking = thinking
        self._clock = clock
        self._stagger = Stagger()
        self._live: dict[int, tuple[str, Match]] = {}
        self._locks: WeakValueDictionary[int, asyncio.Lock] = WeakValueDictionary()

    def __len__(self) -> int:
        return len(self._live)

    async def of(self, visit: Visit) -> Match | None:
        """The match of the round a visit is at; None when it is at no round, or its round is over already."""
        lock = self._locks.setdefault(visit.row.id, asyncio.Lock())
        async with lock:
            step = visit.step
            if visit.progress.status != "active" or step.kind != "round":
                return None
            there = self._live.get(visit.row.id)
            if there is not None and there[0] == step.id:
                return there[1]
            row = await self._row(visit, step)
            if row.status != "open":
                # The server stopped between closing the round and moving on.
                await self._visits.happened(visit, RoundEnded(step.id, row.status))  # type: ignore[arg-type]
                return None
            match = await self._make(visit, step, row)
            self._live[visit.row.id] = (step.id, match)
            return match

    async def skip(self, visit: Visit) -> bool:
        """Whether the round a visit is at was skipped; only some practice rounds may be."""
        step = visit.step
        if step.kind != "round" or not step.data["skippable"]:
            return False
        match = await self.of(visit)
        if match is None:
            return False
        match.end("skipped")
        await match.ended()
        return True

    async def give_up(self, visit: Visit) -> None:
        """End the round a visit is at, if it has begun, as abandoned: the visit's time is over."""
        row = await asyncio.wrap_future(self._store.open_round(visit.row.id, visit.step.id))
        if row is None or row.status != "open":
            return
        match = await self.of(visit)
        if match is not None:
            match.end("abandoned")
            await match.ended()

    async def stop(self) -> None:
        """Stop every match for a shutdown: all that was played is journalled, rounds that are over closed."""
        for _, match in tuple(self._live.values()):
            match.stop()
            await match.ended()

    async def stop_visit(self, visit_id: int) -> None:
        """Stop the match of a visit that is to be erased, if it has one; the round's end is not written."""
        there = self._live.pop(visit_id, None)
        if there is None:
            return
        match = there[1]
        connection = match.connection
        if connection is not None:
            connection.close(wire.CLOSE_ENDED)
            match.leave(connection)
        match.stop()
        await match.ended()

    # ---- setting up ----------------------------------------------------------------------------------------

    async def _row(self, visit: Visit, step: Step) -> RoundRow:
        row = await asyncio.wrap_future(self._store.open_round(visit.row.id, step.id))
        if row is not None:
            return row
        data = step.data
        bundle = self._catalogue.bundle(data["agent"])
        layout = round_layout(self._layouts, data)
        await asyncio.wrap_future(
            self._store.create_round(
                visit.row.id,
                step.id,
                data["round_no"],
                json.dumps(layout.to_dict()),
                layout.name,
                layout.rules.horizon_ticks,
                data["tick_ms"],
                data["human_seat"],
                bundle.name,
                bundle.sha256,
                data["partner_hat"],
                data["seed"],
                self._clock.ms(),
                human_hat=data["human_hat"],
            )
        )
        made = await asyncio.wrap_future(self._store.open_round(visit.row.id, step.id))
        if made is None:
            raise RuntimeError(f"round of visit {visit.row.id} at {step.id} vanished")
        return made

    async def _make(self, visit: Visit, step: Step, row: RoundRow) -> Match:
        data = step.data
        agent_name = str(row.partner.agent)
        layout = Layout.from_dict(json.loads(row.layout_json))
        bundle = self._catalogue.bundle(agent_name)
        if bundle.sha256 != row.partner.agent_sha256:
            LOG.warning("round %d goes on with another version of agent %s", row.id, agent_name)
        kitchen, agent = await asyncio.wrap_future(
            self._thinking.do(
                lambda: _caught_up(layout, bundle, row.partner.seat, row.seed, row.joint_actions)
            )
        )
        seat = row.human.seat
        own, other = data["human_hat"], data["partner_hat"]
        spec = RoundSpec(
            round_id=row.id,
            tick_ms=row.tick_ms,
            human_seat=seat,
            hats=(own, other) if seat == 0 else (other, own),
            goal=None if data["goal"] is None else data["goal"]["score"],
            round_no=row.round_no,
            of=data["of"],
            tutorial=data["tutorial"],
            countdown_s=visit.study.config.countdown_s,
            abandon_after_s=visit.study.config.abandon_after_s,
            next_url=visit.url,
        )

        async def finish(match: Match, outcome: str) -> None:
            try:
                await self._close(visit, step, match, outcome)
            finally:
                self._forget(visit, match)

        return Match(
            spec,
            kitchen,
            Mind(self._thinking, agent, agent_name),
            RoundJournal(self._store, self._clock, row.id, seat),
            self._clock,
            stagger=self._stagger.phase(),
            finish=finish,
            idle=lambda match: self._forget(visit, match),
        )

    async def _close(self, visit: Visit, step: Step, match: Match, outcome: str) -> None:
        kitchen = match.kitchen
        await asyncio.wrap_future(
            self._store.finish_round(
                match.spec.round_id,
                outcome,
                kitchen.score,
                int(kitchen.view.deliveries),
                self._clock.ms(),
                kitchen.state.astype("<i2").tobytes(),
            )
        )
        await self._visits.happened(visit, RoundEnded(step.id, outcome))  # type: ignore[arg-type]

    def _forget(self, visit: Visit, match: Match) -> None:
        there = self._live.get(visit.row.id)
        if there is not None and there[1] is match:
            del self._live[visit.row.id]


def round_layout(layouts: Mapping[str, Layout], data: Mapping[str, Any]) -> Layout:
    """The layout of a round step, with the round's length as its horizon."""
    return layouts[data["layout"]].with_rules(horizon_ticks=data["ticks"])


def _caught_up(
    layout: Layout, bundle: Any, seat: int, seed: int, joint_actions: NDArray[np.uint8]
) -> tuple[Kitchen, Agent]:
    """A kitchen in which the joint actions (uint8 [T, 2]) have happened, and an agent that has seen them."""
    kitchen = Kitchen(layout)
    agent: Agent
    try:
        agent = bundle.make()
        agent.reset(layout, seat, seed)
    except Exception:  # whatever a researcher's agent raises, the round goes on
        LOG.exception("agent %s cannot be made ready for layout %s", bundle.name, layout.name)
        agent = Unable()
    for first, second in joint_actions.tolist():
        before = kitchen.state.copy()
        kitchen.step(first, second)
        try:
            agent.observe(before, (first, second))
        except Exception:  # as above
            LOG.exception("agent %s cannot take up a round on layout %s", bundle.name, layout.name)
            agent = Unable()
    return kitchen, agent
