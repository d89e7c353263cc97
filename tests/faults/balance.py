"""Arrivals at a study as they come in a real one: many under way at once, some of whom never finish."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from sqlalchemy import Connection, text

from galley.records import Arrival, Planned, Store, VisitRow
from galley.study.study import Study
from galley.study.visit.condition_slots import allocate, capacity, cell_number, cells
from galley.study.visit.plan import plan_visit, visit_seed

MINUTE_MS = 60_000.0
IN_FLIGHT = 50
DROP_OUT = 0.3
COMES_RATHER_THAN_GOES = 0.7
"""So that there are soon as many under way as may be, until places run out."""

Cells = dict[str, tuple[int, int]]
"""(held, completed) of each cell, by its JSON."""


@dataclass
class Recruiting:
    """Lets people arrive, leave and finish, one event after the other, on a clock of its own."""

    store: Store
    study: Study
    rng: random.Random
    now_ms: float = 1e12
    under_way: list[VisitRow] = field(default_factory=list)
    arrived: int = 0
    why: Counter[str] = field(default_factory=Counter)
    left: Counter[str] = field(default_factory=Counter)

    def events(self, arrivals: int) -> Iterator[None]:
        """Yield after every event until so many have come and everybody under way has left or finished."""
        while self.arrived < arrivals or self.under_way:
            self.now_ms += MINUTE_MS * self.rng.expovariate(10.0)
            comes = not self.under_way or (
                len(self.under_way) < IN_FLIGHT and self.rng.random() < COMES_RATHER_THAN_GOES
            )
            if self.arrived < arrivals and comes:
                self._arrive()
            else:
                self._go(self.under_way.pop(self.rng.randrange(len(self.under_way))))
            yield

    def _arrive(self) -> None:
        design = cells(self.study.config)
        now_ms, expires_ms = self.now_ms, self.study.config.slot_expires_min * MINUTE_MS

        def plan(visit_no: int, slot: int | None) -> Planned:
            seed = visit_seed(self.study, visit_no)
            made = plan_visit(self.study, seed, visit_no, slot)
            return Planned(
                seed, made.to_json(), made.condition, cell=design[cell_number(self.study, made.slot)]
            )

        begun = self.store.begin_visit(
            Arrival(self.study.name, self.study.sha256, now_ms),
            plan,
            lambda slots: allocate(slots, now_ms, expires_ms, capacity(self.study)),
        ).result()
        self.arrived += 1
        self.why[begun.why] += 1
        if begun.visit is not None:
            self.under_way.append(begun.visit)
            agreed = self.store.save_answers(begun.visit.id, "consent", {}, 1, "active", round(now_ms))
            assert agreed.result()
        elif begun.why == "later":
            self.now_ms += MINUTE_MS

    def _go(self, visit: VisitRow) -> None:
        """Finish, or leave: some say so, most just close the page."""
        if self.rng.random() >= DROP_OUT:
            how = "completed"
        else:
            how = self.rng.choice(["declined", "failed_checks", "silent", "silent"])
        if (
            how != "silent"
            and not self.store.save_answers(visit.id, "play", {}, 2, how, round(self.now_ms)).result()
        ):
            how = "too late"
        self.left[how] += 1


def counted(connection: Connection) -> Cells:
    """Held and completed slots of every cell, read from the database."""
    found: Cells = {}
    rows = connection.execute(text("SELECT cell, state, count(*) FROM slots GROUP BY cell, state"))
    for cell, state, count in rows:
        key = cell if isinstance(cell, str) else json.dumps(cell)
        held, completed = found.get(key, (0, 0))
        found[key] = (held + count, completed) if state == "held" else (held, completed + count)
    return found
