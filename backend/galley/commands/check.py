"""`galley check`: every problem in a workspace at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import WorkspaceArgument
from galley.errors import InvalidFiles


def check(
    workspace: WorkspaceArgument = Path(),
    study: Annotated[
        str | None, typer.Option(metavar="NAME", help="Check and show one study only.", show_default="all")
    ] = None,
) -> None:
    """Check every file of a workspace, or one study; print all problems, or else what participants will see.

    Remarks on what is no mistake come first. Agents are tried only when the whole workspace is checked. A
    study of the workspace here may also be named in WORKSPACE's place.
    """
    from galley.study.check import check_study, check_workspace, describe
    from galley.study.remarks import study_remarks
    from galley.study.study import load_study
    from galley.workspace import Workspace

    if study is None and not workspace.exists() and str(workspace) in Workspace(Path()).names("studies"):
        workspace, study = Path(), str(workspace)
    place = Workspace(workspace)
    if study is None:
        from galley.agents.catalogue import Catalogue

        problems = [*check_workspace(place), *Catalogue(place).check()]
    else:
        problems = check_study(place, study)
    if problems:
        raise InvalidFiles(problems)
    studies = [load_study(place, name) for name in ([study] if study else place.names("studies"))]
    for remark in dict.fromkeys(remark for one in studies for remark in study_remarks(place, one)):
        typer.echo(f"Remark: {remark}")
    for one in studies:
        typer.echo(describe(one))
    if study is not None:
        typer.echo(f"No problems in {study}.")
        return
    counts = ", ".join(
        f"{len(place.names(kind))} {kind}" for kind in ("layouts", "agents", "questionnaires", "studies")
    )
    typer.echo(f"No problems in {counts}.")
