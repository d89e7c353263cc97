"""Accounts and sessions for the researcher's pages. Passwords come hashed, tokens are hashed here."""

from __future__ import annotations

import hashlib
import secrets
from concurrent.futures import Future
from typing import Any

from sqlalchemy import Connection, Select, delete, select, update

from galley.errors import GalleyError
from galley.records.database.tables import RESEARCHERS, SESSIONS
from galley.records.rows import ResearcherRow, SessionRow
from galley.records.store.store_base import StoreBase
from galley.records.store.visit_writes import new_id


class Researchers:
    """The accounts in a store. Times are ms since 1970."""

    def __init__(self, store: StoreBase) -> None:
        self._store = store

    def put(self, name: str, password_hash: str, at_ms: float) -> Future[ResearcherRow]:
        """The account of this name with this password, new or changed; a change ends its sessions."""

        def work(connection: Connection) -> ResearcherRow:
            there = _find(connection, name)
            if there is None:
                values = {"name": name, "password_hash": password_hash, "created_ms": round(at_ms)}
                new_id(connection, RESEARCHERS, values)
            else:
                mine = RESEARCHERS.c.id == there.id
                connection.execute(update(RESEARCHERS).where(mine).values(password_hash=password_hash))
                connection.execute(delete(SESSIONS).where(SESSIONS.c.researcher_id == there.id))
            made = _find(connection, name)
            if made is None:
                raise GalleyError(f"the account {name!r} could not be made")
            return made

        return self._store.write(work)

    def find(self, name: str) -> Future[ResearcherRow | None]:
        """The account of this name, None if there is none."""
        return self._store.read(lambda connection: _find(connection, name))

    def all(self) -> Future[tuple[ResearcherRow, ...]]:
        """Every account, by name."""
        query = select(RESEARCHERS).order_by(RESEARCHERS.c.name)
        return self._store.read(
            lambda connection: tuple(ResearcherRow(**row) for row in connection.execute(query).mappings())
        )

    def remove(self, name: str) -> Future[bool]:
        """Whether there was an account of this name; it is gone now, with its sessions."""
        gone = delete(RESEARCHERS).where(RESEARCHERS.c.name == name)
        return self._store.write(lambda connection: connection.execute(gone).rowcount == 1)

    def open_session(self, researcher_id: int, at_ms: float, expires_ms: float) -> Future[str]:
        """The secret token of a new session. Sessions that ran out are cleared away."""
        token = secrets.token_urlsafe(32)
        values = {
            "token_sha256": _hash(token),
            "researcher_id": researcher_id,
            "csrf": secrets.token_urlsafe(32),
            "created_ms": round(at_ms),
            "expires_ms": round(expires_ms),
        }

        def work(connection: Connection) -> str:
            connection.execute(delete(SESSIONS).where(SESSIONS.c.expires_ms <= at_ms))
            if connection.execute(_session(token)).first() is None:
                connection.execute(SESSIONS.insert().values(**values))
            return token

        return self._store.write(work)

    def session(self, token: str, at_ms: float) -> Future[SessionRow | None]:
        """The session with this token, None if there is none or it ran out."""

        def query(connection: Connection) -> SessionRow | None:
            found = connection.execute(_session(token)).mappings().one_or_none()
            if found is None or found["expires_ms"] <= at_ms:
                return None
            who = ResearcherRow(**{name: found[name] for name in ResearcherRow.__slots__})
            return SessionRow(who, found["csrf"], found["expires_ms"])

        return self._store.read(query)

    def close_session(self, token: str) -> Future[bool]:
        """Whether there was such a session; it is gone now."""
        gone = delete(SESSIONS).where(SESSIONS.c.token_sha256 == _hash(token))
        return self._store.write(lambda connection: connection.execute(gone).rowcount == 1)


def _find(connection: Connection, name: str) -> ResearcherRow | None:
    found = connection.execute(select(RESEARCHERS).where(RESEARCHERS.c.name == name)).mappings().one_or_none()
    return None if found is None else ResearcherRow(**found)


def _hash(token: str) -> str:
    # Not salted: the token is 256 random bits, so there is nothing to guess.
    return hashlib.sha256(token.encode()).hexdigest()


def _session(token: str) -> Select[Any]:
    joined = select(SESSIONS.c.csrf, SESSIONS.c.expires_ms, RESEARCHERS).join(
        RESEARCHERS, RESEARCHERS.c.id == SESSIONS.c.researcher_id
    )
    return joined.where(SESSIONS.c.token_sha256 == _hash(token))
