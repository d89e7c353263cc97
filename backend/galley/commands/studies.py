"""`galley studies`: what belongs to the writing of studies."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import WorkspaceArgument
from galley.errors import GalleyError

app = typer.Typer(help="Help with writing studies.", no_args_is_help=True, rich_markup_mode=None)


@app.command()
def preview(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="The study to walk through.")],
    workspace: WorkspaceArgument = Path(),
    host: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Address to listen on.", show_default="127.0.0.1"),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.", show_default="8000"),
    ] = None,
) -> None:
    """Serve a study to walk through it: nothing of it is kept, and no place of the design is taken."""
    from galley.server.run import preview as run

    run(workspace, study=study, host=host, port=port)


@app.command()
def schema(
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the schemas; made if need be.")
    ] = Path("schemas"),
) -> None:
    """Write the JSON Schema of every kind of YAML file, for editors that complete and check them."""
    from galley.study.written.schema import write_schemas

    for path in write_schemas(out):
        typer.echo(path)


@app.command()
def catalogue(
    language: Annotated[str, typer.Argument(metavar="LANGUAGE", help="Its code, such as it or pt-BR.")],
    workspace: WorkspaceArgument = Path(),
) -> None:
    """Write every message that a language lacks into the workspace's locale/LANGUAGE.po, to be filled in.

    What stands there already stays. Galley's own words are these: buttons, messages, the cards of a round.
    """
    from galley.files.whole import write_whole
    from galley.translations import LANGUAGE, Catalogues, unfinished
    from galley.workspace import Workspace

    if not re.fullmatch(LANGUAGE, language):
        raise GalleyError(f"'{language}' is no code of a language; use one such as it or pt-BR")
    folder = Workspace(workspace).folder("catalogues")
    known = Catalogues.load(folder)
    spelt = (folder / f"{language.replace('-', '_')}.po", folder / f"{language}.po")
    path = next((file for file in spelt if file.is_file()), spelt[-1])
    text = path.read_text(encoding="utf-8-sig") if path.is_file() else ""
    text, count = unfinished(language, known, text)
    if not count:
        typer.echo(f"Nothing is missing in {language}, or {path} holds it to be filled in.")
        return
    write_whole(path, text)
    typer.echo(f"{path}: {count} messages to translate")
