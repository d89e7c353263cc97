"""Files with people's data are for one account (A10); an unwritable database is told at start (A9)."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from galley.errors import GalleyError
from galley.records import Store
from tests.postgres import running as postgres_running
from tests.server.helpers import ONE_ROUND, Participant, serving
from tests.serving import run_galley
from tests.study.workspaces import study_workspace

NOBODY = 65534


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@contextmanager
def as_nobody() -> Iterator[Path]:
    """A folder in which this process is no more than anybody, whoever started it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        was_root = os.geteuid() == 0
        if was_root:
            os.chown(folder, NOBODY, NOBODY)
            os.seteuid(NOBODY)
        try:
            yield folder
        finally:
            if was_root:
                os.seteuid(0)


def test_a10_what_holds_peoples_data_is_for_one_account(tmp_path: Path) -> None:
    """The folder, the database with its log, and the lock; a folder that is there keeps its mode."""
    before = os.umask(0o022)
    try:
        with Store.open(tmp_path / "lab" / ".data" / "records.sqlite", serving=True) as store:
            store.flush().result()
            made = [tmp_path / "lab" / ".data", *(tmp_path / "lab" / ".data").iterdir()]
            assert {path.name: oct(mode(path)) for path in made if mode(path) & 0o077} == {}
            assert len(made) >= 4, "the write-ahead log and the lock are among them"
        shared = tmp_path / "shared"
        shared.mkdir(mode=0o755)
        with Store.open(shared / "records.sqlite", serving=True):
            assert mode(shared) == 0o755
    finally:
        os.umask(before)


def test_a10_exports_are_for_one_account(tmp_path: Path) -> None:
    """A sibling: what `galley export` writes."""
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    with serving(lab, lab.database) as server:
        Participant(server).agree()
    done = run_galley("export", "mine", "--out", tmp_path / "out", "--workspace", lab.path)
    assert done.returncode == 0, done.stderr
    assert [path for path in [tmp_path / "out", *(tmp_path / "out").iterdir()] if mode(path) & 0o077] == []


def test_a9_a_database_that_cannot_be_written_is_refused_at_start() -> None:
    """A file 0444, and its siblings: a folder in which no log can be made, a file that is a folder."""
    with as_nobody() as folder:
        file = folder / "records.sqlite"
        Store.open(file, serving=True).close()
        file.chmod(0o444)
        told(file, "Permission denied")
        file.chmod(0o600)
        folder.chmod(0o555)
        for log in folder.glob("*-wal"):
            log.unlink()
        told(file, "Permission denied|cannot be written|unable to open|readonly")
        folder.chmod(0o700)
        (folder / "folder").mkdir()
        told(folder / "folder", "directory")
        Store.open(file, serving=True).close()


def told(database: Path | str, why: str) -> None:
    with pytest.raises(GalleyError, match=why) as error:
        Store.open(database, serving=True)
    assert "--database" in str(error.value)
    assert "\n" not in str(error.value)


def test_a9_a_postgresql_user_who_may_only_read_is_refused_at_start() -> None:
    """A sibling: the default is to read only, as on a standby."""
    with postgres_running() as server:
        url = server.url("postgres")
        Store.open(url, serving=True).close()
        server.execute("alter role galley set default_transaction_read_only = on")
        told(url, "cannot be written.*read-only")
