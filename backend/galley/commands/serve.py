"""`galley serve`: participants' pages and rounds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import DatabaseOption, WorkspaceArgument


def serve(
    workspace: WorkspaceArgument = Path(),
    study: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Serve this study alone.", show_default="all of the workspace"),
    ] = None,
    host: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Address to listen on.", show_default="127.0.0.1"),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.", show_default="8000"),
    ] = None,
    database: DatabaseOption = None,
    debug: Annotated[
        bool | None,
        typer.Option("--debug", help="Check every message to a browser against the protocol's table."),
    ] = None,
) -> None:
    """Serve the studies of a workspace and print where they are to be found."""
    from galley.server.run import serve as run

    run(workspace, study=study, host=host, port=port, database=database, debug=debug)
