"""Which of several serving processes a round belongs to, and that no other writes it.

A lease has a number that grows each time the round changes hands. The owner's journal is written in the same
transaction that sees the number unchanged (and locks it), so who lost the round writes nothing more of it:
the fencing of Kleppmann 2016, "How to do distributed locking".
"""

from __future__ import annotations

import threading
import time
from collections.abc import Collection, Iterable

from sqlalchemy import Connection, func, select, text, update

from galley.errors import GalleyError
from galley.records.database.engine import insert_into
from galley.records.database.tables import LEASES, ROUNDS

RENEWALS_PER_TTL = 3


class LeaseLost(GalleyError):
    """Another serving process has taken the round over."""


class Lease:
    """A round that this process may write, until `lost`. The store renews it."""

    __slots__ = ("_gone", "_lost", "number", "owner", "renew_at_s", "round_id", "ttl_s")

    def __init__(self, round_id: int, owner: str, number: int, ttl_s: float) -> None:
        self.round_id = round_id
        self.owner = owner
        self.number = number
        self.ttl_s = ttl_s
        self._lost = threading.Event()
        self.renewed()

    @property
    def lost(self) -> bool:
        """Whether another process has taken the round over, or it was erased."""
        return self._lost.is_set()

    def lose(self) -> None:
        """Mark it lost, for good."""
        self._lost.set()

    def renewed(self) -> None:
        """Note that it runs from now on; `renew_at_s` (monotonic) is when to renew it."""
        self.renew_at_s = time.monotonic() + self.ttl_s / RENEWALS_PER_TTL


def now_ms(connection: Connection) -> int:
    """The one clock that all processes on a database share."""
    if connection.dialect.name == "postgresql":
        clock = text("SELECT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint)")
        return int(connection.execute(clock).scalar_one())
    return round(time.time() * 1000)


def take(
    connection: Connection, round_id: int, owner: str, ttl_s: float, steal: bool, address: str | None = None
) -> int | None:
    """The number of the new lease of `owner`; None if another process holds one that has not run out.

    `address` is where other processes reach the owner.

    Raises:
        GalleyError: there is no such round.
    """
    if connection.execute(select(ROUNDS.c.id).where(ROUNDS.c.id == round_id)).first() is None:
        raise GalleyError(f"there is no round {round_id}")
    now = now_ms(connection)
    new = insert_into(connection.engine, LEASES).values(
        round_id=round_id, owner=owner, number=1, expires_ms=now + round(ttl_s * 1000), address=address
    )
    free = (LEASES.c.expires_ms <= now) | LEASES.c.owner.is_(None) | (LEASES.c.owner == owner)
    taken = new.on_conflict_do_update(
        index_elements=[LEASES.c.round_id],
        set_={
            "owner": new.excluded.owner,
            "expires_ms": new.excluded.expires_ms,
            "address": new.excluded.address,
            "number": LEASES.c.number + 1,
        },
        where=None if steal else free,
    )
    return connection.execute(taken.returning(LEASES.c.number)).scalar_one_or_none()


def address(connection: Connection, round_id: int) -> str | None:
    """Where the process is that has a round; None if nobody has it or it did not say."""
    query = select(LEASES.c.address).where(LEASES.c.round_id == round_id, LEASES.c.owner.is_not(None))
    return connection.execute(query).scalar_one_or_none()


def fence(connection: Connection, leases: Iterable[Lease]) -> tuple[Lease, ...]:
    """Those of `leases` that are lost. The others cannot be taken until this transaction is over."""
    wanted = {lease.round_id: lease for lease in leases}
    if not wanted:
        return ()
    query = select(LEASES.c.round_id, LEASES.c.number).where(LEASES.c.round_id.in_(wanted))
    rows = connection.execute(query.order_by(LEASES.c.round_id).with_for_update(read=True))
    now = {row.round_id: row.number for row in rows}
    return tuple(lease for round_id, lease in wanted.items() if now.get(round_id) != lease.number)


def renew(connection: Connection, leases: Collection[Lease]) -> tuple[Lease, ...]:
    """Those of `leases` that are lost; the others run from now on."""
    lost = []
    now = now_ms(connection) if leases else 0
    for lease in sorted(leases, key=lambda lease: lease.round_id):
        longer = update(LEASES).where(LEASES.c.round_id == lease.round_id, LEASES.c.number == lease.number)
        expires_ms = func.max if connection.dialect.name == "sqlite" else func.greatest
        until = expires_ms(LEASES.c.expires_ms, now + round(lease.ttl_s * 1000))
        if connection.execute(longer.values(expires_ms=until)).rowcount == 0:
            lost.append(lease)
    return tuple(lost)


def release(connection: Connection, lease: Lease) -> bool:
    """Let the next process take the round at once; False if one has it already."""
    mine = (LEASES.c.round_id == lease.round_id) & (LEASES.c.number == lease.number)
    free = update(LEASES).where(mine).values(owner=None, expires_ms=0)
    return connection.execute(free).rowcount == 1
