"""The server's log: no secrets, one line for what is expected to fail, and a count instead of repeats."""

from __future__ import annotations

import logging
import re
import sys
import time
from typing import Final, TextIO

from galley.errors import GalleyError
from galley.records.database.retries import DatabaseFailure

FORM: Final = "%(levelname)s %(name)s: %(message)s"
WINDOW_S: Final = 10.0
AT_ONCE: Final = 5
"""So many records of one kind are written in a window; the others are counted."""

MOST_KINDS: Final = 1000
LONGEST: Final = 2000
EXPECTED: Final = (GalleyError, OSError, DatabaseFailure, UnicodeError)
"""What the world does to a server: told in a line. Anything else is our fault and told in full, once."""

SECRETS: Final = re.compile(
    r"(?i)(/v/|galley-test=|[?&]code=|(?<![\w-])(?:set-)?cookie: *|authorization: *|token['\"]?[=:] *['\"]?)"
    r"((?<=cookie: )[^\r\n]+|[^\s/?&'\"<>,;)\]}]+)"
)


def hidden(text: str) -> str:
    """A text without the tokens of visits, test links, invitations and sessions that stand in it."""
    return SECRETS.sub(r"\1…", text)


class OneLine(logging.Formatter):
    """A record in one line; the traceback of what is not expected comes with it if `whole`."""

    def __init__(self) -> None:
        super().__init__(FORM)

    def line(self, record: logging.LogRecord, *, whole: bool) -> str:
        """The record as it is written."""
        said = " ".join(record.getMessage().split())
        error = record.exc_info[1] if record.exc_info else None
        if error is not None:
            said = f"{said} ({type(error).__name__}: {' '.join(str(error).split())})"
        text = f"{record.levelname} {record.name}: {said[:LONGEST]}"
        if whole and error is not None and not isinstance(error, EXPECTED):
            text = f"{text}\n{self.formatException(record.exc_info)}"  # type: ignore[arg-type]
        return hidden(text)


class Counting(logging.Handler):
    """Writes records to a stream: AT_ONCE of a kind in WINDOW_S seconds, then how many more there were.

    A kind is what is said before anything is put in, with the exception's type.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        super().__init__()
        self._stream = sys.stderr if stream is None else stream
        self._lines = OneLine()
        self._kinds: dict[tuple[str, str, str], tuple[float, int]] = {}
        self._shown: set[tuple[str, str, str]] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record, or count it."""
        try:
            now_s = time.monotonic()
            self._tell_counted(now_s)
            error = record.exc_info[1] if record.exc_info else None
            kind = (record.name, str(record.msg)[:LONGEST], type(error).__name__)
            since_s, count = self._kinds.get(kind, (now_s, 0))
            if count == 0 and len(self._kinds) >= MOST_KINDS:
                self._tell_counted(now_s + WINDOW_S)
            self._kinds[kind] = (since_s, count + 1)
            if count < AT_ONCE:
                self._write(self._lines.line(record, whole=kind not in self._shown))
                if error is not None and len(self._shown) < MOST_KINDS:
                    self._shown.add(kind)
        except Exception:  # a log that fails must not stop what is logged
            self.handleError(record)

    def close(self) -> None:
        """Tell what was counted and not told."""
        self._tell_counted(time.monotonic() + WINDOW_S)
        super().close()

    def _tell_counted(self, now_s: float) -> None:
        over = [kind for kind, (since_s, _) in self._kinds.items() if now_s - since_s >= WINDOW_S]
        for kind in over:
            _, count = self._kinds.pop(kind)
            if count > AT_ONCE:
                name, said, _ = kind
                self._write(
                    hidden(f"WARNING {name}: {count - AT_ONCE} more in {WINDOW_S:.0f} s: {said}"[:LONGEST])
                )

    def _write(self, text: str) -> None:
        self._stream.write(text + "\n")
        self._stream.flush()


def log_to(stream: TextIO | None, level: str) -> Counting:
    """The handler that from now on writes everything logged in this process from `level` on."""
    handler = Counting(stream)
    root = logging.getLogger()
    root.addHandler(handler)
    root.setLevel(level.upper())
    logging.captureWarnings(capture=True)
    return handler
