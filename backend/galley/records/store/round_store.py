"""The part of the store that is about rounds: set up, leased, journalled, finished."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future

from sqlalchemy import Connection

from galley.records.database import leases
from galley.records.database.journal_rows import Journal
from galley.records.database.leases import Lease
from galley.records.rows import ClockRow, KeyRow, NewRound, PauseRow, RoundRow, TickRow
from galley.records.store import pairing, queries, round_writes
from galley.records.store.pairing import Together, Waits
from galley.records.store.store_base import StoreBase


class RoundStore(StoreBase):
    """What is written and read about rounds."""

    def set_up_round(self, new: NewRound) -> Future[int]:
        """The id of the round that its people play at these steps, set up now unless it was before.

        Fails with GalleyError if one of them plays another round at that step.
        """
        return self.write(lambda connection: round_writes.set_up(connection, new))

    def open_round(self, visit_id: int, step_id: str) -> Future[RoundRow | None]:
        """The visit's round at this step with everything journalled so far, None if it was never set up.

        Its `status` may be other than "open": a server may have died between a round's end and the next page.
        """
        return self.write(lambda connection: queries.round_of(connection, visit_id, step_id), first="all")

    def wait_for_partner(self, waits: Waits, gone_s: float, together: Together) -> Future[int | None]:
        """The id of the round of a visit that waits for another person; None while nobody is there.

        Who asked last `gone_s` seconds ago does not wait any more. `together` says what round two visits
        play; it is called in the writer's thread. Servers take turns, so nobody is paired twice.
        """
        return self.write(lambda connection: pairing.wait(connection, waits, gone_s, together))

    def stop_waiting(self, visit_id: int, step_id: str) -> Future[int | None]:
        """None once nobody can be paired with the visit at this step; its round if it was paired before."""
        return self.write(lambda connection: pairing.stop(connection, visit_id, step_id))

    def lease_round(
        self, round_id: int, owner: str, ttl_s: float, steal: bool = False, address: str | None = None
    ) -> Future[Lease | None]:
        """The right of process `owner` to write the round; None while another process has it.

        It runs for `ttl_s` seconds of the database's clock and is renewed by this store until it is released,
        the round is finished, or it is `lost`. With `steal` it is taken from a process that still has it.
        `address` is where other processes reach this one.
        """

        def work(connection: Connection) -> Lease | None:
            number = leases.take(connection, round_id, owner, ttl_s, steal, address)
            return None if number is None else Lease(round_id, owner, number, ttl_s)

        # Held from the writer's thread, so that a result nobody waits for any more is renewed all the same.
        leased = self.write(work, first=round_id)
        leased.add_done_callback(self._hold)
        return leased

    def _hold(self, leased: Future[Lease | None]) -> None:
        if leased.exception() is None and (lease := leased.result()) is not None:
            self._writer.hold(lease)

    def release(self, lease: Lease) -> Future[bool]:
        """Write the rest of the round's journal and let the next process have it; False if one has it."""
        self._writer.let_go(lease)
        return self.write(lambda connection: leases.release(connection, lease), first=lease.round_id)

    def journal(
        self,
        round_id: int,
        ticks: Sequence[TickRow] = (),
        keys: Sequence[KeyRow] = (),
        pauses: Sequence[PauseRow] = (),
        clocks: Sequence[ClockRow] = (),
        lease: Lease | None = None,
    ) -> None:
        """Take rows to be written within a second. A row that was written before stays as it was.

        With a `lease` they are written only while it stands.
        """
        rows = Journal(list(ticks), list(keys), list(pauses), list(clocks), lease)
        self._writer.journal(round_id, rows)

    def stand_in(
        self,
        round_id: int,
        seat: int,
        tick: int,
        agent: str,
        agent_sha256: str,
        at_ms: float,
        lease: Lease | None = None,
    ) -> Future[bool]:
        """Note that an agent plays a person's seat from `tick` on; False if one did already."""
        values = {
            "seat": seat,
            "tick": tick,
            "agent": agent,
            "agent_sha256": agent_sha256,
            "at_ms": round(at_ms),
        }
        return self.write(lambda connection: round_writes.stand_in(connection, round_id, values, lease))

    def finish_round(
        self,
        round_id: int,
        status: str,
        score: int,
        deliveries: int,
        ended_at_ms: float,
        final_state: bytes,
        lease: Lease | None = None,
    ) -> Future[bool]:
        """Write the rest of a round's journal and close it; False, with nothing changed, if it was closed.

        The lease is released. Fails with LeaseLost if another process has taken the round over.
        """

        def work(connection: Connection) -> bool:
            end = (status, score, deliveries, round(ended_at_ms), final_state)
            closed = round_writes.finish(connection, round_id, *end, lease)
            self._writer.forget(round_id)
            return closed

        if lease is not None:
            self._writer.let_go(lease)
        return self.write(work, first=round_id)
