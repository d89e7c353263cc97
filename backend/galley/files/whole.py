"""Files and folders that are there whole or not at all, whenever a program is stopped."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

from galley.errors import GalleyError
from galley.files.scratch import Scratch, clear_parts, hold

FORMER: Final = ".former"


PART: Final = ".galley-part"
"""Ends the name of a file that is not whole yet."""


def clear_left(folder: Path) -> None:
    """Remove what processes that were killed left half-written in a folder."""
    clear_parts(folder, PART)


@contextmanager
def whole_path(path: Path) -> Iterator[Path]:
    """The path to write a file at, which takes the place of `path` once the block ends and it is on the disk.

    After an error `path` is as it was and nothing else is left. Of a process that was killed a file stays
    that `clear_left` finds; who writes `path` next overwrites it.
    """
    part = path.with_name(f".{path.name}{PART}")
    held = hold(part)
    try:
        yield part
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
        os.close(held)


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A file to write bytes to, as `whole_path`; the folders of `path` are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_path(path) as part, part.open("wb") as file:
        yield file


def write_whole(path: Path, content: str | bytes) -> None:
    """Write `content`, text as UTF-8 with its line ends as they are, to `path` whole or not at all."""
    with whole_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)


@contextmanager
def whole_folder(path: Path, *, replace: bool = False, kept: bool = False) -> Iterator[Path]:
    """A folder of the name of `path` to fill, which takes its place when the block ends.

    It begins empty, or with all that is in `path` where that is `kept`. After an error `path` is as it was.
    What processes left beside it that were killed meanwhile is taken away.

    Raises:
        GalleyError: there is a `path` already and it may not be replaced, or it cannot be put there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = Scratch(".part-", path.parent, _put_back)
    folder, former = scratch.path / path.name, scratch.path / FORMER
    try:
        if kept and path.exists():
            shutil.copytree(path, folder)
        folder.mkdir(exist_ok=True)
        yield folder
        try:
            if replace and path.exists():
                path.rename(former)
            folder.rename(path)
        except OSError as error:
            if former.exists():
                former.rename(path)
            raise GalleyError(f"{path}: cannot be put there ({error.strerror or error})") from None
    finally:
        scratch.close()


def _put_back(left: Path) -> None:
    """Put a folder back in its place that a process was killed in the middle of replacing."""
    former = left / FORMER
    names = [entry.name for entry in left.iterdir() if not entry.name.startswith(".")]
    if former.is_dir() and len(names) == 1 and not (left.parent / names[0]).exists():
        former.rename(left.parent / names[0])
