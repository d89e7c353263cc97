"""`galley export`: a study's records as CSV."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import DatabaseOption, WorkspaceOption


def export(
    study: Annotated[str, typer.Argument(help="Name of the study.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write the CSV files to.")],
    workspace: WorkspaceOption = Path(),
    database: DatabaseOption = None,
) -> None:
    """Write participants, rounds, ticks, responses and events as CSV, with their data dictionary."""
    from galley.records.export import export_study
    from galley.records.store import Store
    from galley.workspace import Workspace

    store = Store.open(database or Workspace(workspace).database, must_exist=True)
    try:
        rows = export_study(store, study, out)
    finally:
        store.close()
    for file, count in rows.items():
        typer.echo(f"{out / file}: {count} rows")
