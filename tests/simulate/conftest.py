"""A server with the study of every item."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.server.helpers import Served, serving
from tests.simulate.every_item import EVERY, QUIZ, STUDY
from tests.study.workspaces import study_workspace


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder: Path = tmp_path_factory.mktemp("every")
    workspace = study_workspace(folder / "lab", STUDY, "every")
    for name, text in (("every", EVERY), ("understood", QUIZ)):
        (workspace.folder("questionnaires") / f"{name}.yaml").write_text(text, encoding="utf-8")
    with serving(workspace, folder / "records.sqlite") as up:
        yield up
