"""`galley studies`: what belongs to the writing of studies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="Help with writing studies.", no_args_is_help=True, rich_markup_mode=None)


@app.command()
def schema(
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the schemas; made if need be.")
    ] = Path("schemas"),
) -> None:
    """Write the JSON Schema of every kind of YAML file, for editors that complete and check them."""
    from galley.study.schema import write_schemas

    for path in write_schemas(out):
        typer.echo(path)
