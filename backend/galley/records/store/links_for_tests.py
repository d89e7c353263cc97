"""Links with which researchers walk a study that runs, without counting in it."""

from __future__ import annotations

import secrets
from concurrent.futures import Future
from dataclasses import dataclass, field

from sqlalchemy import Connection, delete, insert, select

from galley.records.database.tables import TEST_LINKS
from galley.records.store.store_base import StoreBase
from galley.records.store.visit_writes import meet


@dataclass(frozen=True, slots=True)
class LinkForTests:
    """A link that is good until it expires (ms since 1970); `cell` is the place of a cell in the design."""

    token: str = field(repr=False)
    study: str
    cell: int | None
    author: str
    created_ms: int
    expires_ms: int


class LinksForTests:
    """The test links in a store."""

    def __init__(self, store: StoreBase) -> None:
        self._store = store

    def make(
        self, study: str, cell: int | None, author: str, at_ms: float, expires_ms: float
    ) -> Future[LinkForTests]:
        """A new link; those that have expired are cleared away."""
        token = secrets.token_urlsafe(24)
        made = LinkForTests(token, study, cell, author, round(at_ms), round(expires_ms))
        values = {name: getattr(made, name) for name in LinkForTests.__slots__}

        def work(connection: Connection) -> LinkForTests:
            connection.execute(delete(TEST_LINKS).where(TEST_LINKS.c.expires_ms <= at_ms))
            meet(connection, study)
            if _find(connection, token) is None:  # unless this job was done before
                connection.execute(insert(TEST_LINKS).values(**values))
            return made

        return self._store.write(work)

    def find(self, study: str, token: str, at_ms: float) -> Future[LinkForTests | None]:
        """The link with this token, if it is one of the study and has not expired."""

        def query(connection: Connection) -> LinkForTests | None:
            found = _find(connection, token)
            return found if found is not None and found.study == study and found.expires_ms > at_ms else None

        return self._store.read(query)

    def of_study(self, study: str, at_ms: float) -> Future[tuple[LinkForTests, ...]]:
        """The links of a study that have not expired, newest first."""
        good = (TEST_LINKS.c.study == study) & (TEST_LINKS.c.expires_ms > at_ms)
        query = select(TEST_LINKS).where(good).order_by(TEST_LINKS.c.created_ms.desc(), TEST_LINKS.c.token)
        return self._store.read(
            lambda connection: tuple(LinkForTests(**row) for row in connection.execute(query).mappings())
        )

    def withdraw(self, study: str, token: str) -> Future[bool]:
        """Whether there was such a link; it is good for nothing from now on."""
        gone = delete(TEST_LINKS).where(TEST_LINKS.c.study == study, TEST_LINKS.c.token == token)
        return self._store.write(lambda connection: connection.execute(gone).rowcount == 1)


def _find(connection: Connection, token: str) -> LinkForTests | None:
    found = connection.execute(select(TEST_LINKS).where(TEST_LINKS.c.token == token)).mappings().one_or_none()
    return None if found is None else LinkForTests(**found)
