"""`galley check`: every problem in a workspace at once."""

from __future__ import annotations

from pathlib import Path

import typer

from galley.commands.options import WorkspaceArgument
from galley.errors import InvalidFiles


def check(workspace: WorkspaceArgument = Path()) -> None:
    """Check every file of a workspace; print all problems, or else what participants will see."""
    from galley.agents.catalogue import Catalogue
    from galley.study.check import check_workspace, describe
    from galley.study.study import load_study
    from galley.workspace import Workspace

    place = Workspace(workspace)
    problems = [*check_workspace(place), *Catalogue(place).check()]
    if problems:
        raise InvalidFiles(problems)
    for name in place.names("studies"):
        typer.echo(describe(load_study(place, name)))
    counts = ", ".join(
        f"{len(place.names(kind))} {kind}" for kind in ("layouts", "agents", "questionnaires", "studies")
    )
    typer.echo(f"No problems in {counts}.")
