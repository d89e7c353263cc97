"""Workspaces for tests: the repository's layouts, agents and questionnaires with studies of their own."""

from __future__ import annotations

import shutil
from pathlib import Path

from galley.workspace import Workspace

ROOT = Path(__file__).resolve().parents[2]


def short_workspace(folder: Path) -> Workspace:
    """A workspace in `folder` whose only study is `short`: every stage, rounds of 40 ticks at 50 ms."""
    copy_parts(folder)
    shutil.copytree(ROOT / "tests" / "workspaces" / "short" / "studies", folder / "studies")
    return Workspace(folder)


def study_workspace(folder: Path, study: str, name: str = "mine") -> Workspace:
    """A workspace in `folder` whose only study is the text `study`, which may use what the repository has."""
    copy_parts(folder)
    (folder / "studies").mkdir()
    (folder / "studies" / f"{name}.yaml").write_text(study, encoding="utf-8")
    return Workspace(folder)


def copy_parts(folder: Path) -> None:
    """Copy the repository's layouts, agents and questionnaires into `folder`."""
    folder.mkdir(exist_ok=True)
    for part in ("layouts", "agents", "questionnaires"):
        shutil.copytree(ROOT / part, folder / part)
