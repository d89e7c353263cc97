"""Erasing a participant for good: from the tables, and from the files below them."""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass

from sqlalchemy import Connection, Engine, delete, select, text, update
from sqlalchemy.exc import DBAPIError

from galley.errors import GalleyError
from galley.records.database.engine import insert_into
from galley.records.database.tables import CLOCKS, ERASURES, KEYS, METADATA, ROUNDS, SEATS, VISITS
from galley.records.store.store import Store

SCRUB_S = 30.0


@dataclass(frozen=True, slots=True)
class Erased:
    """How much is gone; `before` says that the rows were, when this was asked for, and only the files not."""

    visits: int
    rounds: int
    before: bool = False


def erase_participant(store: Store, who: str | int) -> Erased:
    """What was erased of a participant, named by a visit's id or by the name in the exports.

    Gone are the visits with everything below them, and the rounds that nobody else played. A round with
    another person stays that person's: of the erased one only the actions of a chef without a name remain.
    Slots that were completed stay completed, and every other row keeps its id and its place. A match that is
    under way must be stopped before. With SQLite the file is rewritten, so that nothing is left in its pages
    or its log; with PostgreSQL the tables are, while its write-ahead log keeps old pages until it is reused.
    What was interrupted after the rows were gone is finished when the same is asked for again, by the next
    erasure, and when a server starts.

    Raises:
        GalleyError: there is no such participant, or another program keeps the old pages in use (then erase
            once more when that has ended).
    """
    erased = store.write(lambda connection: _erase(connection, who), first="all").result()
    if erased is None:
        raise GalleyError(f"{store.name}: there is no participant or visit {who!r}")
    finish_erasures(store)
    return erased


def finish_erasures(store: Store) -> int:
    """How many erasures were not through with the database's files before, and are now.

    Raises:
        GalleyError: another program keeps the old pages in use for too long.
    """
    waiting = store.read(
        lambda connection: connection.execute(select(ERASURES.c.name_sha256)).scalars().all()
    )
    names = waiting.result()
    if names:
        scrub(store.engine)
        done = delete(ERASURES).where(ERASURES.c.name_sha256.in_(names))
        store.write(lambda connection: connection.execute(done)).result()
    return len(names)


def is_unfinished(connection: Connection, participant: str) -> bool:
    """Whether somebody of this name was erased, of whom something may still be in the database's files."""
    return _unfinished(connection, participant) is not None


def _unfinished(connection: Connection, who: str | int) -> Erased | None:
    here = ERASURES.c.name_sha256 == _hash(str(who))
    row = connection.execute(select(ERASURES).where(here)).one_or_none()
    return None if row is None else Erased(row.visits, row.rounds, before=True)


def _hash(name: str) -> str:
    return hashlib.sha256(name.encode()).hexdigest()


def _erase(connection: Connection, who: str | int) -> Erased | None:
    """What is gone from the tables now or is since before; None if nobody was there."""
    mine = (VISITS.c.id == who) if isinstance(who, int) else (VISITS.c.participant == who)
    name = connection.execute(select(VISITS.c.participant).where(mine).limit(1)).scalar()
    if name is None:
        return _unfinished(connection, who)
    visits = connection.execute(select(VISITS.c.id).where(VISITS.c.participant == name)).scalars().all()
    sitting = select(SEATS.c.round_id, SEATS.c.seat).where(SEATS.c.visit_id.in_(visits))
    gone = 0
    for round_id, seat in connection.execute(sitting).all():
        others = select(SEATS.c.seat).where(
            SEATS.c.round_id == round_id, SEATS.c.visit_id.is_not(None), SEATS.c.visit_id.not_in(visits)
        )
        if connection.execute(others).first() is None:
            gone += connection.execute(delete(ROUNDS).where(ROUNDS.c.id == round_id)).rowcount
            continue
        here = (SEATS.c.round_id == round_id) & (SEATS.c.seat == seat)
        nobody = {"visit_id": None, "step_id": None, "rtt_median_ms": None}
        connection.execute(update(SEATS).where(here).values(**nobody))
        for table in (KEYS, CLOCKS):
            theirs = (table.c.round_id == round_id) & (table.c.seat == seat)
            connection.execute(delete(table).where(theirs))
    connection.execute(delete(VISITS).where(VISITS.c.id.in_(visits)))
    # Only its hash: what is deleted from here stays in the files.
    row = {"name_sha256": _hash(name), "visits": len(visits), "rounds": gone}
    connection.execute(insert_into(connection.engine, ERASURES).values(**row).on_conflict_do_nothing())
    return Erased(len(visits), gone)


def scrub(engine: Engine) -> None:
    """Rewrite the database so that nothing deleted is left in its files.

    Raises:
        GalleyError: another program keeps the old pages in use for too long.
    """
    if engine.dialect.name == "sqlite":
        _scrub_sqlite(engine)
        return
    with engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        for table in METADATA.sorted_tables:
            connection.execute(text(f"VACUUM (FULL, ANALYZE) {table.name}"))
        try:
            connection.execute(text("CHECKPOINT"))
        except DBAPIError:  # needs a right that the account may lack; the server does so by itself in minutes
            return


def _scrub_sqlite(engine: Engine) -> None:
    connection = engine.raw_connection()
    try:
        cursor = connection.cursor()
        cursor.execute("VACUUM")
        patience = time.monotonic() + SCRUB_S
        # (busy, pages in the log, pages moved): busy as long as somebody reads what was there before.
        while cursor.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0]:
            if time.monotonic() > patience:
                told = "the rows are erased, but another program keeps reading the old ones"
                raise GalleyError(f"{told}; stop it and erase once more")
            time.sleep(0.05)
    finally:
        connection.close()
