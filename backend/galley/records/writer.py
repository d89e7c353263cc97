"""The one thread that writes: jobs in order, each in its own transaction, and the journal now and then."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, Literal, TypeVar

from sqlalchemy import Connection, Engine, func
from sqlalchemy.exc import DBAPIError, OperationalError

from galley.errors import GalleyError
from galley.records.engine import insert_into
from galley.records.rows import ClockRow, Health, KeyRow, PauseRow, TickRow
from galley.records.tables import CLOCKS, KEYS, PAUSES, TICKS

T = TypeVar("T")
LOG = logging.getLogger(__name__)

# A killed process may lose a second at most, and a tick reaches the journal up to a tick after it was played:
# this wait, a tick of 150 ms and the commit stay within the second.
FLUSH_EVERY_S = 0.75
CLOSE_TRIES = 5


@dataclass(slots=True)
class Journal:
    """Rows of one round that wait to be written."""

    ticks: list[TickRow] = field(default_factory=list)
    keys: list[KeyRow] = field(default_factory=list)
    pauses: list[PauseRow] = field(default_factory=list)
    clocks: list[ClockRow] = field(default_factory=list)

    def extend(self, other: Journal) -> None:
        """Take in rows that came after these."""
        self.ticks += other.ticks
        self.keys += other.keys
        self.pauses += other.pauses
        self.clocks += other.clocks

    def __len__(self) -> int:
        return len(self.ticks) + len(self.keys) + len(self.pauses) + len(self.clocks)


@dataclass(slots=True)
class _Job:
    work: Callable[[Connection], Any] | None
    done: Future[Any]
    first: int | Literal["all"] | None


class Writer:
    """Owns every write of a process. Its methods return at once and may be called from any thread."""

    def __init__(self, engine: Engine, flush_every_s: float = FLUSH_EVERY_S) -> None:
        self._engine = engine
        self._insert = _inserts(engine)
        self._flush_every_s = flush_every_s
        self._jobs: SimpleQueue[_Job | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._waiting: dict[int, Journal] = {}
        self._flush_at = 0.0
        self._trouble = ""
        self._lost_rows = 0
        self._loss = ""
        self._closed = False
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
            if self._closed:
                done.set_exception(GalleyError("the records are closed"))
                return done
            self._jobs.put(_Job(work, done, first))
        return done

    def journal(self, round_id: int, rows: Journal) -> None:
        """Keep `rows` for the next flush. Raises GalleyError after `close`."""
        with self._lock:
            if self._closed:
                raise GalleyError("the records are closed")
            if not self._waiting:
                self._flush_at = time.monotonic() + self._flush_every_s
                self._jobs.put(None)
            self._waiting.setdefault(round_id, Journal()).extend(rows)

    def flush(self) -> Future[None]:
        """Done when everything journalled before this call is committed."""
        return self._put(None, "all")

    def health(self) -> Health:
        """How writing fares now."""
        with self._lock:
            waiting = sum(len(rows) for rows in self._waiting.values())
            message = self._trouble or self._loss
            return Health(not message, message, waiting, self._lost_rows)

    def close(self) -> None:
        """Finish the jobs, write the journal, stop the thread.

        Raises: GalleyError if journalled rows could not be written.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
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
            if job is not None:
                self._do(job)
            elif self._closed and self._jobs.empty():
                break
            if self._waiting and time.monotonic() >= self._flush_at:
                self._flush()
        for _ in range(CLOSE_TRIES):
            if not self._waiting or self._flush():
                return
            time.sleep(self._flush_every_s / CLOSE_TRIES)

    def _rest_s(self) -> float | None:
        with self._lock:
            return max(0.0, self._flush_at - time.monotonic()) if self._waiting else None

    def _do(self, job: _Job) -> None:
        try:
            if job.first is not None and not self._flush(job.first):
                raise GalleyError(f"the records cannot be written: {self._trouble}")
            result = None
            if job.work is not None:
                with self._engine.begin() as connection:
                    result = job.work(connection)
                self._trouble = ""
        except BaseException as error:  # handed to whoever waits for the job; the thread must live on
            if isinstance(error, DBAPIError):
                self._trouble = one_line(error)
            job.done.set_exception(error)
        else:
            job.done.set_result(result)

    def _flush(self, which: int | Literal["all"] = "all") -> bool:
        """Whether the journal, or one round's part of it, is out of the way: committed or refused."""
        with self._lock:
            if which == "all":
                batch, self._waiting = self._waiting, {}
            else:
                batch = {which: self._waiting.pop(which)} if which in self._waiting else {}
        return self._write(batch)

    def _write(self, batch: dict[int, Journal]) -> bool:
        if not batch:
            return True
        try:
            with self._engine.begin() as connection:
                for statement, rows in self._statements(batch):
                    if rows:
                        connection.execute(statement, rows)
        except Exception as error:  # any fault here must leave the rows somewhere
            if _passes(error):
                self._put_back(batch, one_line(error))
                return False
            if len(batch) > 1:  # one bad round must not take the others along
                written = [self._write({round_id: rows}) for round_id, rows in batch.items()]
                return all(written)
            self._lose(batch, error)
            return True
        self._trouble = ""
        return True

    def _put_back(self, batch: dict[int, Journal], trouble: str) -> None:
        LOG.warning("the journal could not be written and will be tried again: %s", trouble)
        with self._lock:
            self._trouble = trouble
            for round_id, rows in batch.items():
                if round_id in self._waiting:
                    rows.extend(self._waiting[round_id])
                self._waiting[round_id] = rows
            self._flush_at = time.monotonic() + self._flush_every_s

    def _lose(self, batch: dict[int, Journal], error: Exception) -> None:
        for round_id, rows in batch.items():
            with self._lock:
                self._lost_rows += len(rows)
                self._loss = f"{self._lost_rows} journal rows were refused by the database: {one_line(error)}"
            LOG.error("round %d: %d journal rows were refused: %s", round_id, len(rows), one_line(error))

    def _statements(self, batch: dict[int, Journal]) -> Iterator[tuple[Any, list[dict[str, Any]]]]:
        """The inserts for `batch`. A row that is there already stays as it is; a pause learns its end."""
        journals = batch.items()
        yield self._insert[TICKS.name], _with_round((i, rows.ticks) for i, rows in journals)
        yield self._insert[KEYS.name], _with_round((i, rows.keys) for i, rows in journals)
        yield self._insert[PAUSES.name], _with_round((i, rows.pauses) for i, rows in journals)
        yield self._insert[CLOCKS.name], _with_round((i, rows.clocks) for i, rows in journals)


def one_line(error: BaseException) -> str:
    """What went wrong, without SQLAlchemy's statement and link."""
    cause = error.orig if isinstance(error, DBAPIError) and error.orig is not None else error
    return " ".join(str(cause).split()) or type(cause).__name__


def _passes(error: Exception) -> bool:
    """Whether trying again may help: the database was away, busy or full, rather than the rows wrong."""
    cut_off = isinstance(error, DBAPIError) and error.connection_invalidated
    return cut_off or isinstance(error, OperationalError)


def _with_round(journals: Iterable[tuple[int, Iterable[Any]]]) -> list[dict[str, Any]]:
    return [
        {"round_id": round_id, **{name: getattr(row, name) for name in row.__slots__}}
        for round_id, rows in journals
        for row in rows
    ]


def _inserts(engine: Engine) -> dict[str, Any]:
    kept = (TICKS, KEYS, CLOCKS)
    inserts = {table.name: insert_into(engine, table).on_conflict_do_nothing() for table in kept}
    pause = insert_into(engine, PAUSES)
    ended = func.coalesce(pause.excluded.ended_ms, PAUSES.c.ended_ms)
    inserts[PAUSES.name] = pause.on_conflict_do_update(
        index_elements=[PAUSES.c.round_id, PAUSES.c.started_ms], set_={"ended_ms": ended}
    )
    return inserts
