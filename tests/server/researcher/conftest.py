"""The researcher's pages over a small pilot of a short study, with a clock that the tests turn."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.study.study import load_study
from tests.server.researcher.office import Office, open_office
from tests.study.workspaces import short_workspace


@pytest.fixture(scope="session")
def office(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Office]:
    """The pages with some visits; what tests change here, no other test counts on."""
    folder = tmp_path_factory.mktemp("office")
    workspace = short_workspace(folder / "lab")
    with open_office(folder / "records.sqlite", workspace, load_study(workspace, "short")) as office:
        yield office


@pytest.fixture
def fresh(tmp_path: Path, office: Office) -> Iterator[Office]:
    """The pages over records of their own, with one researcher and no visit."""
    with open_office(tmp_path / "fresh.sqlite", office.workspace, office.study, visits=False) as fresh:
        yield fresh
