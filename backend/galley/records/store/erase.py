"""Erasing a participant for good: from the tables, and from the files below them."""

from __future__ import annotations

import time
from dataclasses import dataclass

from sqlalchemy import Connection, Engine, delete, select, text, update
from sqlalchemy.exc import DBAPIError

from galley.errors import GalleyError
from galley.records.database.tables import CLOCKS, KEYS, METADATA, ROUNDS, SEATS, VISITS
from galley.records.store.store import Store

SCRUB_S = 30.0


@dataclass(frozen=True, slots=True)
class Erased:
    """How much is gone."""

    visits: int
    rounds: int


def erase_participant(store: Store, who: str | int) -> Erased:
    """What was erased of a participant, named by a visit's id or by the name in the exports.

    Gone are the visits with everything below them, and the rounds that nobody else played. A round with
    another person stays that person's: of the erased one only the actions of a chef without a name remain.
    Slots that were completed stay completed, and every other row keeps its id and its place. A match that is
    under way must be stopped before. With SQLite the file is rewritten, so that nothing is left in its pages
    or its log; with PostgreSQL the tables are, while its write-ahead log keeps old pages until it is reused.

    Raises:
        GalleyError: there is no such participant, or another program keeps the old pages in use (then erase
            once more when that has ended).
    """
    erased = store.write(lambda connection: _erase(connection, who), first="all").result()
    scrub(store.engine)
    if not erased.visits:
        raise GalleyError(f"{store.name}: there is no participant or visit {who!r}")
    return erased


def _erase(connection: Connection, who: str | int) -> Erased:
    mine = (VISITS.c.id == who) if isinstance(who, int) else (VISITS.c.participant == who)
    names = select(VISITS.c.participant).where(mine).scalar_subquery()
    visits = connection.execute(select(VISITS.c.id).where(VISITS.c.participant.in_(names))).scalars().all()
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
