"""Rows of rounds on their way into the database, many at a time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import Connection, Engine, bindparam, func, select, update

from galley.records.engine import insert_into
from galley.records.leases import Lease
from galley.records.rows import ClockRow, KeyRow, PauseRow, TickRow
from galley.records.tables import CLOCKS, KEYS, PAUSES, SEATS, TICKS, VISITS


@dataclass(slots=True)
class Journal:
    """Rows of one round that wait to be written, and the lease that allows it, if one is needed."""

    ticks: list[TickRow] = field(default_factory=list)
    keys: list[KeyRow] = field(default_factory=list)
    pauses: list[PauseRow] = field(default_factory=list)
    clocks: list[ClockRow] = field(default_factory=list)
    lease: Lease | None = None

    def extend(self, other: Journal) -> None:
        """Take in rows that came after these."""
        self.ticks += other.ticks
        self.keys += other.keys
        self.pauses += other.pauses
        self.clocks += other.clocks
        self.lease = other.lease or self.lease

    def __len__(self) -> int:
        return len(self.ticks) + len(self.keys) + len(self.pauses) + len(self.clocks)

    def seen(self) -> dict[int, float]:
        """For each seat, when its person last gave a sign of life, in ms since 1970."""
        found: dict[int, float] = {}
        for seat, at_ms in (
            *((key.seat, key.arrival_ms) for key in self.keys),
            *((ping.seat, ping.server_ms) for ping in self.clocks),
        ):
            found[seat] = max(at_ms, found.get(seat, 0.0))
        return found


class JournalInserts:
    """Writes journals. A row that is there already stays as it is; a pause learns its end."""

    def __init__(self, engine: Engine) -> None:
        kept = {table.name: insert_into(engine, table) for table in (TICKS, KEYS, CLOCKS)}
        self._ticks, self._keys, self._clocks = (new.on_conflict_do_nothing() for new in kept.values())
        pause = insert_into(engine, PAUSES)
        self._pauses = pause.on_conflict_do_update(
            index_elements=[PAUSES.c.round_id, PAUSES.c.started_ms],
            set_={"ended_ms": func.coalesce(pause.excluded.ended_ms, PAUSES.c.ended_ms)},
        )
        here = select(SEATS.c.visit_id).where(
            SEATS.c.round_id == bindparam("of_round"), SEATS.c.seat == bindparam("at_seat")
        )
        self._seen = (
            update(VISITS)
            .where(VISITS.c.id == here.scalar_subquery(), VISITS.c.last_seen_ms < bindparam("at_ms"))
            .values(last_seen_ms=bindparam("at_ms"))
        )

    def write(self, connection: Connection, batch: Mapping[int, Journal]) -> None:
        """Insert the rows of all rounds in `batch`."""
        for statement, rows in self._statements(batch):
            if rows:
                connection.execute(statement, rows)

    def write_seen(self, connection: Connection, seen: Mapping[tuple[int, int], float]) -> None:
        """Note when people were last seen, by round and seat."""
        rows = [
            {"of_round": round_id, "at_seat": seat, "at_ms": round(at_ms)}
            for (round_id, seat), at_ms in sorted(seen.items())
        ]
        if rows:
            connection.execute(self._seen, rows)

    def _statements(self, batch: Mapping[int, Journal]) -> Iterator[tuple[Any, list[dict[str, Any]]]]:
        journals = batch.items()
        yield self._ticks, _with_round((i, rows.ticks) for i, rows in journals)
        yield self._keys, _with_round((i, rows.keys) for i, rows in journals)
        yield self._pauses, _with_round((i, rows.pauses) for i, rows in journals)
        yield self._clocks, _with_round((i, rows.clocks) for i, rows in journals)


def _with_round(journals: Iterable[tuple[int, Iterable[Any]]]) -> list[dict[str, Any]]:
    return [
        {"round_id": round_id, **{name: getattr(row, name) for name in row.__slots__}}
        for round_id, rows in journals
        for row in rows
    ]
