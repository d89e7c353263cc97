"""The one thread that writes: jobs in order, each in its own transaction, and the journal now and then."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, Literal, TypeVar

from sqlalchemy import Connection, Engine

from galley.errors import GalleyError
from galley.records.database import leases
from galley.records.database.journal_rows import Journal, JournalInserts
from galley.records.database.leases import Lease
from galley.records.database.retries import RETRY_FOR_S, Retries, is_transient, one_line
from galley.records.rows import Health

T = TypeVar("T")
LOG = logging.getLogger(__name__)

# A killed process may lose a second at most, and a tick reaches the journal up to a tick after it was played:
# this wait, a tick of 150 ms and the commit stay within the second.
FLUSH_EVERY_S = 0.75
CLOSE_TRIES = 5
# About 200 MB, or five minutes of 500 rounds, while the database is away.
MOST_WAITING_ROWS = 1_000_000
SEEN_EVERY_MS = 10_000
STALE_S = 5.0


@dataclass(slots=True)
class _Job:
    work: Callable[[Connection], Any] | None
    done: Future[Any]
    first: int | Literal["all"] | None
    born_s: float = field(default_factory=time.monotonic)


class Writer:
    """Owns every write of a process. Its methods return at once and may be called from any thread."""

    def __init__(
        self, engine: Engine, flush_every_s: float = FLUSH_EVERY_S, retry_for_s: float = RETRY_FOR_S
    ) -> None:
        self._engine = engine
        self._inserts = JournalInserts(engine)
        self._flush_every_s = flush_every_s
        self._retry_for_s = retry_for_s
        self._jobs: SimpleQueue[_Job | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._waiting: dict[int, Journal] = {}
        self._waiting_rows = 0
        self._leases: dict[int, Lease] = {}
        self._seen: dict[tuple[int, int], float] = {}
        self._flush_at = 0.0
        self._trouble = ""
        self._lost_rows = 0
        self._fenced_rows = 0
        self._loss = ""
        self._closing = threading.Event()
        # When what the thread is at was asked for; later jobs are younger.
        self._oldest_s: float | None = None
        self._thread = threading.Thread(target=self._run, name="galley-writer", daemon=True)
        self._thread.start()

    def submit(
        self, work: Callable[[Connection], T], *, first: int | Literal["all"] | None = None
    ) -> Future[T]:
        """The result of `work` in its own transaction, given once that is committed.

        `first`: what waits in the journal, for one round or for all of them, is written before.
        """
        return self._put(work, first)

    def _put(self, work: Callable[[Connection], T] | None, first: int | Literal["all"] | None) -> Future[T]:
        done: Future[T] = Future()
        # Running from the start: a request given up by its browser must not take its answer along.
        done.set_running_or_notify_cancel()
        with self._lock:
            if self._closing.is_set():
                done.set_exception(GalleyError("the records are closed"))
                return done
            self._jobs.put(_Job(work, done, first))
        return done

    def journal(self, round_id: int, rows: Journal) -> None:
        """Keep `rows` for the next flush.

        Raises:
            GalleyError: after `close`.
        """
        with self._lock:
            if self._closing.is_set():
                raise GalleyError("the records are closed")
            if self._waiting_rows + len(rows) > MOST_WAITING_ROWS:
                self._count_lost(len(rows), f"more than {MOST_WAITING_ROWS} were waiting")
                return
            if not self._waiting:
                self._flush_at = time.monotonic() + self._flush_every_s
                self._jobs.put(None)
            there = self._waiting.setdefault(round_id, rows)
            if there is not rows:
                there.extend(rows)
            self._waiting_rows += len(rows)

    def hold(self, lease: Lease) -> None:
        """Renew `lease` from now on."""
        with self._lock:
            self._leases[lease.round_id] = lease
            self._jobs.put(None)

    def let_go(self, lease: Lease) -> None:
        """Renew it no longer."""
        with self._lock:
            if self._leases.get(lease.round_id) is lease:
                del self._leases[lease.round_id]

    def flush(self) -> Future[None]:
        """Done when everything journalled before this call is committed."""
        return self._put(None, "all")

    def health(self) -> Health:
        """How writing fares now."""
        oldest_s = self._oldest_s
        waited_s = 0.0 if oldest_s is None else time.monotonic() - oldest_s
        with self._lock:
            message = self._trouble or self._loss
            if not self._thread.is_alive() and not self._closing.is_set():
                message = "the writing thread has ended"
            elif not message and waited_s > STALE_S:
                message = f"a write has waited for {waited_s:.0f} s"
            return Health(not message, message, self._waiting_rows, self._lost_rows, self._fenced_rows)

    def close(self) -> None:
        """Finish the jobs, write the journal, stop the thread.

        Raises:
            GalleyError: journalled rows could not be written.
        """
        with self._lock:
            if self._closing.is_set():
                return
            self._closing.set()
            self._jobs.put(None)
        self._thread.join()
        health = self.health()
        if health.waiting_rows:
            raise GalleyError(f"{health.waiting_rows} journal rows could not be written: {health.message}")

    # ---- the writer's thread -------------------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            try:
                job = self._jobs.get(timeout=self._rest_s())
            except Empty:
                job = None
            self._oldest_s = time.monotonic() if job is None else job.born_s
            if job is not None:
                self._do(job)
            elif self._closing.is_set() and self._jobs.empty():
                break
            now = time.monotonic()
            if (self._waiting and now >= self._flush_at) or self._due(now):
                self._flush()
            self._oldest_s = None
        for _ in range(CLOSE_TRIES):
            if not self._waiting or self._flush():
                return
            time.sleep(self._flush_every_s / CLOSE_TRIES)

    def _rest_s(self) -> float | None:
        with self._lock:
            times = [lease.renew_at_s for lease in self._leases.values()]
            if self._waiting:
                times.append(self._flush_at)
            return max(0.0, min(times) - time.monotonic()) if times else None

    def _due(self, now_s: float) -> list[Lease]:
        with self._lock:
            return [lease for lease in self._leases.values() if lease.renew_at_s <= now_s]

    def _do(self, job: _Job) -> None:
        retries = Retries(self._engine, job.born_s + self._retry_for_s, self._closing)
        while True:
            try:
                if job.first is not None and not self._flush(job.first):
                    raise _Unwritten
                result = None
                if job.work is not None:
                    with self._engine.begin() as connection:
                        result = job.work(connection)
                    self._trouble = ""
            except _Unwritten:
                if retries.wait():
                    continue
                job.done.set_exception(GalleyError(f"the records cannot be written: {self._trouble}"))
            except BaseException as error:  # handed to whoever waits for the job; the thread must live on
                if is_transient(error):
                    self._trouble = one_line(error)
                    if retries.wait():
                        continue
                job.done.set_exception(retries.failure(error))
            else:
                job.done.set_result(result)
            return

    def _flush(self, which: int | Literal["all"] = "all") -> bool:
        """Whether the journal, or one round's part of it, is out of the way: committed or refused."""
        with self._lock:
            if which == "all":
                batch, self._waiting = self._waiting, {}
            else:
                batch = {which: self._waiting.pop(which)} if which in self._waiting else {}
            self._waiting_rows -= sum(map(len, batch.values()))
        return self._write(batch, self._due(time.monotonic()))

    def _write(self, batch: dict[int, Journal], due: list[Lease]) -> bool:
        if not batch and not due:
            return True
        seen = self._seen_in(batch)
        held = [rows.lease for rows in batch.values() if rows.lease is not None]
        try:
            with self._engine.begin() as connection:
                lost = leases.fence(connection, held)
                gone = {lease.round_id for lease in lost}
                self._inserts.write(connection, {i: rows for i, rows in batch.items() if i not in gone})
                self._inserts.write_seen(connection, seen)
                renewing = [lease for lease in due if lease.round_id not in gone]
                lost += leases.renew(connection, renewing)
        except Exception as error:  # any fault here must leave the rows somewhere
            if is_transient(error):
                self._put_back(batch, due, one_line(error))
                return False
            if not batch:
                self._put_back({}, due, one_line(error))
                return False
            if len(batch) > 1:  # one bad round must not take the others along
                written = [self._write({round_id: rows}, []) for round_id, rows in batch.items()]
                return all(written) and self._write({}, due)
            self._lose(batch, error)
            return self._write({}, due)
        self._trouble = ""
        self._seen |= seen
        for lease in due:
            lease.renewed()
        for lease in lost:
            self._fence(lease, batch.get(lease.round_id))
        return True

    def _seen_in(self, batch: dict[int, Journal]) -> dict[tuple[int, int], float]:
        """Signs of life worth a write: the first, and the next some seconds later."""
        return {
            (round_id, seat): at_ms
            for round_id, rows in batch.items()
            for seat, at_ms in rows.seen().items()
            if at_ms >= self._seen.get((round_id, seat), float("-inf")) + SEEN_EVERY_MS
        }

    def forget(self, round_id: int) -> None:
        """Drop what is kept in memory about a round that is over. For jobs, in the writer's thread."""
        for seat in (0, 1):
            self._seen.pop((round_id, seat), None)

    def _fence(self, lease: Lease, rows: Journal | None) -> None:
        lease.lose()
        self.let_go(lease)
        with self._lock:
            self._fenced_rows += len(rows or ())
        LOG.warning("round %d was taken over by another server", lease.round_id)

    def _put_back(self, batch: dict[int, Journal], due: list[Lease], trouble: str) -> None:
        if trouble != self._trouble:
            LOG.warning("the journal could not be written and will be tried again: %s", trouble)
        again = time.monotonic() + self._flush_every_s
        with self._lock:
            self._trouble = trouble
            for round_id, rows in batch.items():
                self._waiting_rows += len(rows)
                if round_id in self._waiting:
                    rows.extend(self._waiting[round_id])
                self._waiting[round_id] = rows
            self._flush_at = again
            for lease in due:
                lease.renew_at_s = again

    def _lose(self, batch: dict[int, Journal], error: Exception) -> None:
        for round_id, rows in batch.items():
            with self._lock:
                self._count_lost(len(rows), one_line(error))
            LOG.error("round %d: %d journal rows were refused: %s", round_id, len(rows), one_line(error))

    def _count_lost(self, rows: int, why: str) -> None:
        self._lost_rows += rows
        self._loss = f"{self._lost_rows} journal rows were refused: {why}"


class _Unwritten(Exception):
    """What a job has to follow could not be written yet."""
