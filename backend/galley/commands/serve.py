"""`galley serve`: participants' pages and rounds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import DatabaseOption, WorkspaceArgument, database_url


def serve(
    workspace: WorkspaceArgument = Path(),
    study: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Serve this study alone.", show_default="every study of the workspace"
        ),
    ] = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on.")] = 8000,
    database: DatabaseOption = None,
) -> None:
    """Serve the studies of a workspace and print where they are to be found."""
    from galley.server.run import serve as run

    run(workspace, study=study, host=host, port=port, database=database_url(workspace, database))
