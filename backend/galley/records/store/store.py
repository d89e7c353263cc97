"""The records as the server sees them: writes are futures, done once they are durable."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Self

from sqlalchemy import Engine, false, update
from sqlalchemy.exc import DBAPIError

from galley.errors import GalleyError
from galley.records.database.engine import connect, database_url, shown, sqlite_file
from galley.records.database.migrate import migrate
from galley.records.database.retries import RETRY_FOR_S, one_line
from galley.records.database.serving_lock import serving_lock
from galley.records.database.tables import STUDIES
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
                to be served and is served already or cannot be written.
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
                # Participants' data: for this account alone, unless somebody opened it to others.
                file.parent.mkdir(0o700, parents=True, exist_ok=True)
                os.close(os.open(file, os.O_CREAT | (os.O_RDWR if serving else os.O_RDONLY), 0o600))
                lock = serving_lock(file) if serving else None
            migrate(url, locked=lock is not None)
        except BaseException as error:
            if lock is not None:
                lock.release()
            if isinstance(error, OSError):
                fix = "name another database with --database"
                raise GalleyError(f"{file}: {error.strerror or error}; {fix}") from None
            raise
        engine = connect(url, writes=True)
        if serving:
            try:
                _check_writable(engine, shown(url))
            except GalleyError:
                engine.dispose()
                if lock is not None:
                    lock.release()
                raise
        return cls(shown(url), engine, connect(url, writes=False), lock, flush_every_s, retry_for_s)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _check_writable(engine: Engine, name: str) -> None:
    """Try a write that changes nothing.

    Raises:
        GalleyError: the database lets nobody write, or not this user.
    """
    try:
        with engine.begin() as connection:
            connection.execute(update(STUDIES).where(false()).values(state=STUDIES.c.state))
    except DBAPIError as error:
        fix = "let this account write it and its folder, or name another database with --database"
        raise GalleyError(f"{name}: the database cannot be written ({one_line(error)}); {fix}") from None
