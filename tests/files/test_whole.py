"""Files and folders that are there whole or not at all, and the lock by a file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from galley.errors import GalleyError
from galley.files.lock import FileLock
from galley.files.whole import whole_file, whole_folder, whole_path, write_whole


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_takes_its_place_when_all_of_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "made" / "file.txt"
    write_whole(path, "old\r\n")
    assert path.read_bytes() == b"old\r\n"
    with whole_file(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_bytes() == b"old\r\n"
    assert path.read_bytes() == b"new"
    assert names(path.parent) == ["file.txt"]


def test_an_error_leaves_the_former_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    write_whole(path, "old")
    with pytest.raises(ZeroDivisionError), whole_path(path) as part:
        part.write_text(f"half {1 // 0}")
    assert names(tmp_path) == ["file.txt"]
    assert path.read_text() == "old"


def test_a_folder_appears_complete_or_not_at_all(tmp_path: Path) -> None:
    home = tmp_path / "agents" / "cook"
    with whole_folder(home) as folder:
        assert folder.name == "cook"
        (folder / "one").write_text("1")
        assert not home.exists()
    assert names(home) == ["one"]
    with pytest.raises(ZeroDivisionError), whole_folder(home, replace=True) as folder:
        (folder / "two").write_text(f"2 {1 // 0}")
    assert names(home) == ["one"]
    with whole_folder(home, replace=True, kept=True) as folder:
        (folder / "two").write_text("2")
    assert names(home) == ["one", "two"]
    with whole_folder(home, replace=True) as folder:
        (folder / "three").write_text("3")
    assert names(home) == ["three"]
    with pytest.raises(GalleyError, match="cannot be put there"), whole_folder(home) as folder:
        (folder / "four").write_text("4")
    assert (names(home), names(home.parent)) == (["three"], ["cook"])


def test_one_holds_a_lock_and_the_next_is_told_who(tmp_path: Path) -> None:
    told = f"^{os.getpid()} works here$"
    with FileLock(tmp_path / "lock", "unused"), pytest.raises(GalleyError, match=told):
        FileLock(tmp_path / "lock", "{holder} works here")
    FileLock(tmp_path / "lock", "unused").release()
