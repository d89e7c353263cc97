"""What every part of the store stands on: one writing thread, some reading ones, one database."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Literal, TypeVar

from sqlalchemy import Connection, Engine, select
from sqlalchemy.exc import DBAPIError

from galley.files.lock import FileLock
from galley.records.database.retries import Retries, is_transient, one_line
from galley.records.database.tables import VISITS
from galley.records.database.writer import Writer
from galley.records.rows import Health

T = TypeVar("T")
READERS = 2
STALE_S = 10.0
"""A question that waits for so long, or failed so short a time ago, is a matter of health."""


class StoreBase:
    """An open database."""

    def __init__(
        self,
        name: str,
        engine: Engine,
        reader: Engine,
        lock: FileLock | None,
        flush_s: float,
        retry_for_s: float,
    ) -> None:
        self.name = name
        self._engine = engine
        self._reader = reader
        self._lock = lock
        self._retry_for_s = retry_for_s
        self._closing = threading.Event()
        self._writer = Writer(engine, flush_s, retry_for_s)
        self._asked: dict[Future[Any], float] = {}
        self._failed: tuple[float, str] | None = None
        self._readers = ThreadPoolExecutor(READERS, thread_name_prefix="galley-reader")

    @property
    def engine(self) -> Engine:
        """For work that no transaction can hold, such as rewriting the file."""
        return self._engine

    @property
    def url(self) -> str:
        """The URL that opens the same database, its password included: never to be shown."""
        return self._engine.url.render_as_string(hide_password=False)

    def write(
        self, work: Callable[[Connection], T], *, first: int | Literal["all"] | None = None
    ) -> Future[T]:
        """The result of `work` in a transaction of its own, given once that is committed.

        `work` may be run again if the database went away, so doing it twice must be as good as once.
        `first`: what waits in the journal, for one round or for all of them, is written before.
        """
        return self._writer.submit(work, first=first)

    def read(self, query: Callable[[Connection], T]) -> Future[T]:
        """The result of `query` on the database as it stands; tried again while that is away."""

        def run(until_s: float = time.monotonic() + self._retry_for_s) -> T:
            retries = Retries(self._reader, until_s, self._closing)
            while True:
                try:
                    with self.reading() as connection:
                        return query(connection)
                except Exception as error:
                    if is_transient(error) and retries.wait():
                        continue
                    if isinstance(error, DBAPIError):
                        self._failed = (time.monotonic(), one_line(error))
                    raise retries.failure(error) from None

        answer = self._readers.submit(run)
        self._asked[answer] = time.monotonic()
        answer.add_done_callback(lambda done: self._asked.pop(done, None))
        return answer

    def probe(self) -> None:
        """Ask the database something, unless a question waits already, so that `health` can tell."""
        if not self._asked and not self._closing.is_set():
            self.read(lambda connection: connection.execute(select(VISITS.c.id).limit(1)).all())

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A connection that sees the database as it stands now, for as long as it is open."""
        with self._reader.connect() as connection:
            if connection.dialect.name == "postgresql":
                connection = connection.execution_options(
                    isolation_level="REPEATABLE READ", postgresql_readonly=True
                )
            with connection.begin():
                yield connection

    def flush(self) -> Future[None]:
        """Done when everything journalled before this call is committed."""
        return self._writer.flush()

    def health(self) -> Health:
        """Whether what is journalled reaches the database, and questions are answered."""
        health = self._writer.health()
        now_s = time.monotonic()
        message = ""
        if self._failed is not None and now_s - self._failed[0] < STALE_S:
            message = f"a question failed: {self._failed[1]}"
        waited_s = now_s - min(list(self._asked.values()), default=now_s)
        if waited_s > STALE_S:
            message = f"a question has waited for {waited_s:.0f} s"
        return replace(health, ok=False, message=message) if health.ok and message else health

    def close(self) -> None:
        """Write what waits, then let go of the database; a second call does nothing.

        Raises:
            GalleyError: journalled rows could not be written.
        """
        self._closing.set()
        try:
            self._writer.close()
        finally:
            self._readers.shutdown()
            self._engine.dispose()
            self._reader.dispose()
            if self._lock is not None:
                self._lock.release()
