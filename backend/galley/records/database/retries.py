"""How long to wait for a database that is away, and what to say when it does not come back."""

from __future__ import annotations

import threading
import time
from typing import Final

from sqlalchemy import Engine
from sqlalchemy.exc import DBAPIError, OperationalError, SQLAlchemyError

from galley.errors import GalleyError

RETRY_FOR_S = 20.0
FIRST_WAIT_S = 0.05
LONGEST_WAIT_S = 1.0

DatabaseFailure: Final = SQLAlchemyError
"""What a database, or the way to it, answers when something goes wrong; for those who know no database."""


class Retries:
    """Waits between tries, a little longer each time, until `until_s` (monotonic) or `closing`.

    SQLite has no tries but the one: its driver has waited for the lock already.
    """

    def __init__(self, engine: Engine, until_s: float, closing: threading.Event) -> None:
        self._server = engine.dialect.name != "sqlite"
        self._until_s = until_s
        self._closing = closing
        self._wait_s = FIRST_WAIT_S

    def wait(self) -> bool:
        """Whether to try again, asked and answered after a wait."""
        if not self._server or time.monotonic() + self._wait_s > self._until_s:
            return False
        if self._closing.wait(self._wait_s):
            return False
        self._wait_s = min(2 * self._wait_s, LONGEST_WAIT_S)
        return True

    def failure(self, error: BaseException) -> BaseException:
        """What to tell whoever waited in vain."""
        if self._server and is_transient(error):
            return GalleyError(f"the records cannot be reached: {one_line(error)}")
        return error


def one_line(error: BaseException) -> str:
    """What went wrong, without SQLAlchemy's statement and link."""
    cause = error.orig if isinstance(error, DBAPIError) and error.orig is not None else error
    return " ".join(str(cause).split()) or type(cause).__name__


def is_transient(error: BaseException) -> bool:
    """Whether trying again may help: the database was away, busy or full, rather than the rows wrong."""
    cut_off = isinstance(error, DBAPIError) and error.connection_invalidated
    return cut_off or isinstance(error, OperationalError)
