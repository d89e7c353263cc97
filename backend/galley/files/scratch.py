"""Folders to work in until something is done, and what is left of them when a program was killed."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

LOCK: Final = ".lock"
OF_OLD_S: Final = 24 * 3600.0
"""A folder of an earlier version, which has no lock, is nobody's any more after so long."""


class Scratch:
    """A new folder in `parent` (the system's for temporary files by default) that is gone when it is closed.

    It is locked for as long as this process lives, and whoever has its `descriptor` (`pass_fds`). Before it
    is made, the folders of the same `prefix` go that belong to this account and to no living process;
    `rescue` may take something out of each.
    """

    def __init__(
        self, prefix: str, parent: Path | None = None, rescue: Callable[[Path], None] = lambda folder: None
    ) -> None:
        home = Path(tempfile.gettempdir()) if parent is None else parent
        for left in home.glob(f"{prefix}????????"):
            _clear(left, rescue)
        while True:
            self.path = Path(tempfile.mkdtemp(prefix=prefix, dir=home))
            self.descriptor = os.open(self.path / LOCK, os.O_RDWR | os.O_CREAT, 0o600)
            # Somebody who clears up may have had it between the two.
            if _locked(self.descriptor) and (self.path / LOCK).exists():
                return
            os.close(self.descriptor)

    def close(self) -> None:
        """Take it away; a second call does nothing."""
        if self.descriptor >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self.descriptor)
            self.descriptor = -1

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.close()


def clear_parts(folder: Path, suffix: str) -> None:
    """Remove files of this ending from a folder that belong to this account and that no process writes."""
    for part in folder.glob(f".*{suffix}"):
        try:
            if part.is_symlink() or part.stat().st_uid != os.getuid():
                continue
            descriptor = os.open(part, os.O_RDONLY | os.O_NOFOLLOW)
        except OSError:
            continue
        try:
            if _locked(descriptor):
                part.unlink(missing_ok=True)
        finally:
            os.close(descriptor)


def hold(path: Path) -> int:
    """A descriptor that keeps the file at `path`, made if need be, from being cleared until it is closed."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    _locked(descriptor)
    return descriptor


def _clear(folder: Path, rescue: Callable[[Path], None]) -> None:
    """Remove a folder that is ours and in which nobody works."""
    try:
        if folder.is_symlink() or not folder.is_dir() or folder.stat().st_uid != os.getuid():
            return
        lock = folder / LOCK
        if not lock.exists():
            if _age_s(folder) > OF_OLD_S:
                rescue(folder)
                shutil.rmtree(folder, ignore_errors=True)
            return
        descriptor = os.open(lock, os.O_RDWR | os.O_NOFOLLOW)
    except OSError:  # another was quicker
        return
    try:
        if _locked(descriptor):
            rescue(folder)
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(descriptor)


def _locked(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _age_s(folder: Path) -> float:
    newest = max((path.stat().st_mtime for path in (folder, *folder.rglob("*"))), default=0.0)
    return time.time() - newest
