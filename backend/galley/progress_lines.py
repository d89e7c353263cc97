"""How far long work has come, for those who wait for it, and an end to work that never comes back."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

Progress = Callable[[str, int, int], None]
"""Takes what is done, how much of it is, and of how much."""

FIRST_AFTER_S: Final = 3.0
EVERY_S: Final = 5.0


def untold(_what: str, _done: int, _of: int) -> None:
    """Tell nobody."""


class ProgressLines:
    """Writes a line to stderr now and then, none for what is over in a moment."""

    def __init__(self) -> None:
        self._began_s = time.monotonic()
        self._next_s = self._began_s + FIRST_AFTER_S

    def __call__(self, what: str, done: int, of: int) -> None:
        """Tell it, unless something was told just now."""
        now_s = time.monotonic()
        if now_s < self._next_s:
            return
        self._next_s = now_s + max(EVERY_S, (now_s - self._began_s) / 10)
        sys.stderr.write(f"{what}: {done} of {of} ({now_s - self._began_s:.0f} s)\n")
        sys.stderr.flush()


@contextmanager
def ends_within(seconds: float, line: str) -> Iterator[None]:
    """End this process with a line on stderr and status 1 if the block takes longer.

    For what others wrote and nothing else can stop, where the block leaves nothing half-made behind.
    """

    def end() -> None:
        sys.stderr.write(f"{line}\n")
        sys.stderr.flush()
        os._exit(1)

    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
