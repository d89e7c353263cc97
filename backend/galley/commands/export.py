"""`galley export`: a study's records as tables and trajectories."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import DatabaseOption, WorkspaceOption


def export(
    study: Annotated[str, typer.Argument(help="Name of the study.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write the files to.")],
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            metavar="FORMAT",
            help="csv, jsonl or parquet; may be given several times.",
            show_default="csv",
        ),
    ] = None,
    trajectories: Annotated[
        bool, typer.Option("--trajectories", help="Also write trajectories.zip: every episode, to replay.")
    ] = False,
    human_data: Annotated[
        bool,
        typer.Option(
            "--human-data",
            help="Also write human-data.csv: every tick in the field's public schema of human games.",
        ),
    ] = False,
    bonuses: Annotated[
        bool,
        typer.Option("--bonuses", help="Also write bonuses.csv: participant_id,amount, to pay in bulk."),
    ] = False,
    tests: Annotated[bool, typer.Option("--tests", help="Include visits made to try the study out.")] = False,
    workspace: WorkspaceOption = Path(),
    database: DatabaseOption = None,
) -> None:
    """Write participants, rounds, ticks, responses and events as CSV, with their data dictionary."""
    from galley.records.export.whole_export import Wanted, write_files
    from galley.records.store.store import Store
    from galley.workspace import Workspace

    os.umask(0o077)  # people's data: for this account alone
    wanted = Wanted(formats or ("csv",), trajectories, human_data, bonuses, tests)
    with Store.open(database or Workspace(workspace).database, must_exist=True) as store:
        written = write_files(store, study, out, wanted)
    for file, count in written.items():
        typer.echo(f"{file}: {count}")
