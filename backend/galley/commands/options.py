"""The options that several commands share, each told once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

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
        envvar="DATABASE",
        help="Where the records are: postgresql://host/name, sqlite:///file or the file itself.",
        show_default=".data/galley.sqlite in the workspace",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for a machine to read.")]
