"""Files and folders that are there whole or not at all, whenever a program is stopped."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from galley.errors import GalleyError


@contextmanager
def whole_path(path: Path) -> Iterator[Path]:
    """The path to write a file at, which takes the place of `path` once the block ends and it is on the disk.

    After an error `path` is as it was and nothing else is left.
    """
    part = path.with_name(f".{path.name}.part")
    try:
        yield part
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


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

    Raises:
        GalleyError: there is a `path` already and it may not be replaced, or it cannot be put there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    staging = Path(tempfile.mkdtemp(prefix=".part-", dir=path.parent))
    folder, former = staging / path.name, staging / ".former"
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
        shutil.rmtree(staging, ignore_errors=True)
