"""Rows of rounds on their way into the database, many at a time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from operator import itemgetter
from typing import Any

from sqlalchemy import Connection, Engine, Table, bindparam, func, select, update

from galley.records.database.engine import insert_into
from galley.records.database.leases import Lease
from galley.records.database.tables import CLOCKS, KEYS, PAUSES, SEATS, TICKS, VISITS
from galley.records.rows import ClockRow, KeyRow, PauseRow, TickRow

MOST_AT_ONCE = 256
"""So many rows go in with one statement: ten values each, far from what either database allows."""


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
        # Rows come in the order of time, so that the last of a seat is its newest.
        found = {key.seat: key.arrival_ms for key in self.keys}
        for seat, at_ms in {ping.seat: ping.server_ms for ping in self.clocks}.items():
            found[seat] = max(at_ms, found.get(seat, 0.0))
        return found


class JournalInserts:
    """Writes journals. A row that is there already stays as it is; a pause learns its end."""

    def __init__(self, engine: Engine) -> None:
        self._ticks = ManyRows(engine, TICKS, TickRow)
        self._keys = ManyRows(engine, KEYS, KeyRow)
        self._clocks = ManyRows(engine, CLOCKS, ClockRow)
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
        journals = batch.items()
        self._ticks.insert(connection, [(i, row) for i, rows in journals for row in rows.ticks])
        self._keys.insert(connection, [(i, row) for i, rows in journals for row in rows.keys])
        self._clocks.insert(connection, [(i, row) for i, rows in journals for row in rows.clocks])
        # One by one: the beginning and the end of a pause may both be here, and are one row.
        if pauses := [{"round_id": i, **row._asdict()} for i, rows in journals for row in rows.pauses]:
            connection.execute(self._pauses, pauses)

    def write_seen(self, connection: Connection, seen: Mapping[tuple[int, int], float]) -> None:
        """Note when people were last seen, by round and seat."""
        rows = [
            {"of_round": round_id, "at_seat": seat, "at_ms": round(at_ms)}
            for (round_id, seat), at_ms in sorted(seen.items())
        ]
        if rows:
            connection.execute(self._seen, rows)


class ManyRows:
    """Inserts rows of one kind, many with one statement; one that is there already stays as it is.

    The database works through a statement without holding the interpreter, which live rounds need: row by
    row it would be taken from them and given back thousands of times a flush. `kind` is a named tuple whose
    fields are the table's columns, all but `round_id`.
    """

    def __init__(self, engine: Engine, table: Table, kind: type[tuple[Any, ...]]) -> None:
        new = insert_into(engine, table).on_conflict_do_nothing()
        by_place = "qmark" if engine.dialect.paramstyle == "qmark" else "format"
        kin: Any = type(engine.dialect)
        text = str(new.compile(dialect=kin(paramstyle=by_place)))
        self._head, values = text.split(" VALUES ")
        self._one, self._tail = values.split(" ON CONFLICT ")
        fields: Sequence[str] = kind._fields  # type: ignore[attr-defined]
        self._pick = itemgetter(*(fields.index(column.name) for column in table.c if column.name in fields))

    def insert(self, connection: Connection, rows: Sequence[tuple[int, Any]]) -> None:
        """Insert rows, each with its round."""
        begin = 0
        while begin < len(rows):
            # Powers of two, so that there are few different statements to prepare.
            count = min(MOST_AT_ONCE, 1 << ((len(rows) - begin).bit_length() - 1))
            connection.exec_driver_sql(self._text(count), self._values(rows[begin : begin + count]))
            begin += count

    def _values(self, rows: Iterable[tuple[int, Any]]) -> tuple[Any, ...]:
        pick = self._pick
        return tuple(chain.from_iterable((round_id, *pick(row)) for round_id, row in rows))

    def _text(self, count: int) -> str:
        return f"{self._head} VALUES {', '.join([self._one] * count)} ON CONFLICT {self._tail}"
