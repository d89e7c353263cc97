"""The records as the server sees them: writes are futures, done once they are durable."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from galley.errors import GalleyError
from galley.records.database.engine import connect, database_url, shown, sqlite_file
from galley.records.database.migrate import migrate
from galley.records.database.retries import RETRY_FOR_S
from galley.records.database.serving_lock import serving_lock
from galley.records.database.writer import FLUSH_EVERY_S
from galley.records.store.round_store import RoundStore
from galley.records.store.visit_store import VisitStore


class Store(VisitStore, RoundStore):
    """One database of visits and rounds. Writes go through one thread, reads through others.

    Futures fail with what went wrong: GalleyError, or SQLAlchemy's error if the database refused.
    Times named `at_ms` are milliseconds since 1970-01-01 UTC.
    """

    @classmethod
    def open(
        cls,
        database: str | Path,
        *,
        serving: bool = False,
        must_exist: bool = False,
        flush_every_s: float = FLUSH_EVERY_S,
        retry_for_s: float = RETRY_FOR_S,
    ) -> Self:
        """The store in `database` (a URL or the path of an SQLite file), made or migrated as needed.

        `flush_every_s` is the most that the journal waits, `retry_for_s` how long writes and reads wait for a
        database server that is away.

        Raises:
            GalleyError: it cannot be opened, is newer than this Galley, does not exist though it must, or is
                to be served and is served already.
        """
        url = database_url(database)
        file = sqlite_file(url)
        if must_exist and file is not None and not file.is_file():
            raise GalleyError(
                f"{file}: there is no such database; name the one that was served with --database"
            )
        lock = None
        try:
            if file is not None:
                file.parent.mkdir(parents=True, exist_ok=True)
                lock = serving_lock(file) if serving else None
            migrate(url, locked=lock is not None)
        except BaseException as error:
            if lock is not None:
                lock.release()
            if isinstance(error, OSError):
                fix = "name another database with --database"
                raise GalleyError(f"{file}: {error.strerror or error}; {fix}") from None
            raise
        reader = connect(url, writes=False)
        return cls(shown(url), connect(url, writes=True), reader, lock, flush_every_s, retry_for_s)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
