"""The options that several commands share, each told once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from galley.errors import GalleyError

WorkspaceArgument = Annotated[
    Path, typer.Argument(help="Folder that holds studies/, layouts/, agents/ and questionnaires/.")
]
WorkspaceOption = Annotated[
    Path,
    typer.Option(
        "--workspace",
        metavar="DIR",
        help="Folder that holds studies/, layouts/, agents/ and questionnaires/.",
    ),
]
DatabaseOption = Annotated[
    str | None,
    typer.Option(
        "--database",
        metavar="URL",
        help="Where the records are, as a URL (sqlite:///file, postgresql://host/name).",
        show_default="SQLite in the workspace: .data/galley.sqlite",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for a machine to read.")]


def database_url(workspace: Path, given: str | None) -> str:
    """Return the URL of the records: the given one, else SQLite inside the workspace.

    Raises:
        GalleyError: what was given is not a URL.
    """
    if given is None:
        return f"sqlite:///{workspace.resolve() / '.data' / 'galley.sqlite'}"
    if "://" not in given:
        raise GalleyError(f"--database {given}: not a URL; for a SQLite file write sqlite:///{given}")
    return given
