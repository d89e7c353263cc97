"""`galley check`: every problem in a workspace at once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from galley.commands.options import WorkspaceArgument
from galley.errors import InvalidFiles

if TYPE_CHECKING:
    from galley.workspace import Workspace


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
        from galley.agents.network import DECISION_S
        from galley.progress_lines import ProgressLines

        problems = [*check_workspace(place), *Catalogue(place, DECISION_S).check(ProgressLines())]
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
    for line in changed_under_way(place):
        typer.echo(line)
    typer.echo(f"No problems in {counts}.")


def changed_under_way(place: Workspace) -> list[str]:
    """What visits under way in the workspace's own database need that is gone, a line for each study."""
    from galley.agents.catalogue import Catalogue
    from galley.kitchen.layout_file import load_layouts
    from galley.records import Store
    from galley.records.reading.overdue import under_way
    from galley.server.changed_files import kept_by, told_of_changes
    from galley.study.study import load_study

    if not Path(place.database).is_file():
        return []
    studies = {name: load_study(place, name) for name in place.names("studies")}
    has = kept_by(load_layouts(place), Catalogue(place))
    with Store.open(place.database) as store:
        return list(told_of_changes(store.read(under_way).result(), studies, has))
