"""The `galley` command: `galley <noun> <verb>`, one line per mistake."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from galley import __version__
from galley.commands import (
    agents,
    check,
    erase,
    evaluate,
    export,
    init,
    researchers,
    serve,
    simulate,
    studies,
    trajectories,
)
from galley.commands.learn import app as learn
from galley.errors import GalleyError
from galley.extras import lacking

app = typer.Typer(
    help="Human-AI experiments in the shared kitchen of Overcooked.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command()(serve.serve)
app.command()(check.check)
app.command()(init.init)
app.command()(export.export)
app.command()(erase.erase)
app.command()(evaluate.evaluate)
app.command()(simulate.simulate)
app.add_typer(trajectories.app, name="trajectories")
app.add_typer(agents.app, name="agents")
app.add_typer(studies.app, name="studies")
app.add_typer(learn.app, name="learn")
app.add_typer(researchers.app, name="researchers")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"galley {__version__}")
        raise typer.Exit


@app.callback()
def _galley(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Exit with 0; with 1 after one line per problem for a user's mistake; with 2 for wrong usage."""
    try:
        app()
    except GalleyError as error:
        typer.echo(error, err=True)
        sys.exit(1)
    except ImportError as error:
        told = lacking(error)
        if told is None:
            raise
        typer.echo(told, err=True)
        sys.exit(1)
    except OSError as error:
        if error.filename is None:
            raise
        typer.echo(f"{error.filename}: {error.strerror}", err=True)
        sys.exit(1)
