"""`galley init`: a workspace to start from."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated, Final

import typer

from galley.errors import GalleyError

FOLDERS: Final = ("layouts", "agents", "questionnaires", "studies")


def init(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder to make; it must not exist or be empty.")
    ],
) -> None:
    """Make a starter workspace: layouts, agents, questionnaires and the demo study, yours to edit."""
    from galley.workspace import Workspace

    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise GalleyError(
            f"{directory}: exists and is not an empty folder; name a new folder for the workspace"
        )
    starter = Workspace.starter()
    for folder in FOLDERS:
        shutil.copytree(starter / folder, directory / folder, ignore=shutil.ignore_patterns("__pycache__"))
    typer.echo(f"Made {directory}. Look at it with: galley serve {directory}")
