"""What keeps a server from starting is told in one line."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from galley.errors import GalleyError, InvalidFiles
from galley.records import Store
from galley.records.database.engine import database_url
from galley.server.run import reached_at, serve
from tests.server.helpers import ONE_ROUND
from tests.study.workspaces import study_workspace


def test_a_port_in_use(tmp_path: Path) -> None:
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(GalleyError, match=f"port {port} .*in use.*choose another") as error:
            serve(lab.path, port=port, environ={})
    assert "\n" not in str(error.value)


def test_an_address_that_is_not_ours(tmp_path: Path) -> None:
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    with pytest.raises(GalleyError, match=r"cannot listen on 203\.0\.113\.1"):
        serve(lab.path, host="203.0.113.1", port=0, environ={})
    with pytest.raises(GalleyError, match="cannot listen on no such host"):
        serve(lab.path, host="no such host", port=0, environ={})


def test_where_other_processes_reach_one(tmp_path: Path) -> None:
    def told(host: str, database: str) -> str:
        with socket.create_server((host, 0)) as listening:
            address = reached_at(listening, database_url(database))
            return address.replace(str(listening.getsockname()[1]), "PORT")

    assert told("127.0.0.1", "postgresql://db.example.org/galley") == "127.0.0.1:PORT"
    assert told("0.0.0.0", "postgresql://127.0.0.1/galley") == "127.0.0.1:PORT", "on the way to the database"
    assert told("0.0.0.0", "postgresql://no-such-host.invalid/galley") == "127.0.0.1:PORT"
    assert told("0.0.0.0", str(tmp_path / "records.sqlite")) == ""


def test_a_database_that_is_served_already(tmp_path: Path) -> None:
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    file = tmp_path / "records.sqlite"
    with Store.open(file, serving=True), pytest.raises(GalleyError, match="already serves") as error:
        serve(lab.path, port=0, database=f"sqlite:///{file}", environ={})
    assert "\n" not in str(error.value)


def test_a_study_that_is_wrong_or_missing(tmp_path: Path) -> None:
    lab = study_workspace(tmp_path / "lab", ONE_ROUND.replace("[random]", "[rndom]"))
    database = f"sqlite:///{tmp_path / 'records.sqlite'}"
    with pytest.raises(InvalidFiles, match="rndom"):
        serve(lab.path, port=0, database=database, environ={})
    with pytest.raises(GalleyError, match="mine"):
        serve(lab.path, port=0, study="mien", database=database, environ={})
    (lab.path / "studies" / "mine.yaml").unlink()
    with pytest.raises(GalleyError, match="no study to serve"):
        serve(lab.path, port=0, database=database, environ={})


def test_a_setting_in_the_environment_that_is_not_possible(tmp_path: Path) -> None:
    with pytest.raises(GalleyError, match="PORT: 'x' is not possible"):
        serve(tmp_path, environ={"PORT": "x"})


def test_a_preview_walks_a_study_and_leaves_nothing_behind(tmp_path: Path) -> None:
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    before = sorted(lab.path.rglob("*"))
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    command = [sys.executable, "-c", "from galley.cli import main; main()", "studies", "preview", "mine"]
    environ = {**os.environ, "TMPDIR": str(scratch)}
    process = subprocess.Popen(
        [*command, lab.path, "--port", "0"], stdout=subprocess.PIPE, env=environ, text=True
    )
    try:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        page = httpx.post(f"{url}/s/mine/begin", follow_redirects=True, timeout=30)
        assert "Test visit" in page.text
        assert list(scratch.rglob("preview.sqlite"))
    finally:
        process.terminate()
        process.communicate(timeout=30)
    assert not list(scratch.rglob("preview.sqlite"))
    assert [path for path in sorted(lab.path.rglob("*")) if "__pycache__" not in str(path)] == before
