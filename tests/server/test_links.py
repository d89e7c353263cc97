"""Links that lose nothing on the way to the study's page (D2), and a folder of any name (F20)."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import httpx
import pytest

from galley.workspace import Workspace
from tests.server.helpers import ONE_ROUND, serving
from tests.serving import served as run_served
from tests.study.workspaces import study_workspace

QUERY = "PROLIFIC_PID=a%2Bb%20c&STUDY_ID=s1&language=en"


def test_d2_the_redirect_from_the_root_keeps_the_query(tmp_path: Path) -> None:
    """Byte for byte, for GET and HEAD; without a query none is made up."""
    with serving(study_workspace(tmp_path / "lab", ONE_ROUND), tmp_path / "records.sqlite") as server:
        for method in ("GET", "HEAD"):
            answer = httpx.request(method, f"{server.url}/?{QUERY}")
            assert answer.headers["location"] == f"/s/mine?{QUERY}"
        assert httpx.get(f"{server.url}/").headers["location"] == "/s/mine"


def test_d2_siblings_keep_the_query_too(tmp_path: Path) -> None:
    """A slash at the end, the form's address loaded again, and the list of several studies."""
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    with serving(lab, tmp_path / "records.sqlite") as server:
        for path in ("/s/mine/", "/s/mine/begin"):
            answer = httpx.get(f"{server.url}{path}?{QUERY}")
            assert answer.is_redirect
            assert answer.headers["location"].removeprefix(server.url) == f"/s/mine?{QUERY}"
    (lab.path / "studies" / "other.yaml").write_text(ONE_ROUND)
    with serving(lab, tmp_path / "records.sqlite") as server:
        page = httpx.get(f"{server.url}/?{QUERY}").text
        assert f'href="/s/other?{QUERY.replace("&", "&amp;")}"' in page
        assert 'href="/s/mine"' in httpx.get(f"{server.url}/").text


@pytest.mark.parametrize("name", ["what now?", "50% #1 & a:b ünï"])
def test_f20_a_folder_of_any_name_keeps_its_records_inside(tmp_path: Path, name: str) -> None:
    """`galley serve "what now?"`: records lie in the workspace; the study's own link is printed (D2)."""
    lab = study_workspace(tmp_path / name, ONE_ROUND)
    with run_served(lab.path, lab.database) as server:
        assert f"{server.url}/s/mine\n" in server.log.read_text()
        begun = httpx.post(f"{server.url}/s/mine/begin")
        assert begun.status_code == 303
    assert sorted(entry.name for entry in tmp_path.iterdir()) == [name]
    file = Workspace(lab.path).path / ".data" / "galley.sqlite"
    assert sqlite3.connect(file).execute("select count(*) from visits").fetchone() == (1,)
