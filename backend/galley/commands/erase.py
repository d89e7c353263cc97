"""`galley erase`: a participant, gone for good."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import DatabaseOption, WorkspaceOption


def erase(
    participant: Annotated[str, typer.Argument(help="Name of the participant, as exports give it.")],
    workspace: WorkspaceOption = Path(),
    database: DatabaseOption = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Erase everything kept of one participant, down to the database's files.

    One that was interrupted is finished when it is asked for again. Exports of all others stay as they were.
    A server that is running keeps its SQLite file to itself: erase on its researcher's pages then.
    """
    from galley.records.store.erase import erase_participant
    from galley.records.store.store import Store
    from galley.workspace import Workspace

    if not yes:
        typer.confirm(f"Erase participant {participant} for good?", abort=True)
    with Store.open(database or Workspace(workspace).database, must_exist=True, serving=True) as store:
        gone = erase_participant(store, participant)
    told = "was erased before, now from the database's files too" if gone.before else "was erased"
    typer.echo(f"{participant} {told}: visits={gone.visits} rounds={gone.rounds}")
