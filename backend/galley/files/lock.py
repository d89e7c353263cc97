"""A lock that one process at a time holds, by a file."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Self

from galley.errors import GalleyError


class FileLock:
    """Held from `FileLock(path, refusal)` to `release()` or the death of the process, however it dies.

    `refusal` is what the next one is told, with `{holder}` for the number of the process that holds it.

    Raises:
        GalleyError: another process, or another lock of this one, holds it.
    """

    def __init__(self, path: Path, refusal: str) -> None:
        self._descriptor: int | None = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.read(self._descriptor, 32).decode(errors="replace").strip() or "unknown"
            self.release()
            raise GalleyError(refusal.replace("{holder}", holder)) from None
        os.truncate(self._descriptor, 0)
        os.write(self._descriptor, str(os.getpid()).encode())

    def release(self) -> None:
        """Let the next one have it; the file stays, since removing it would race with one opening it."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
