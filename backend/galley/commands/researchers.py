"""`galley researchers`: who may log in to the researcher's pages."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import DatabaseOption, WorkspaceOption

app = typer.Typer(help="Who may log in at /researcher: add, list, remove.", no_args_is_help=True)
NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="Name to log in with.")]


@app.command()
def add(name: NameArgument, workspace: WorkspaceOption = Path(), database: DatabaseOption = None) -> None:
    """Add a researcher, or give one a new password, which ends their logins.

    The password is asked for; when standard input is no terminal, its first line is the password.
    """
    from galley.records.store.researcher_accounts import Researchers
    from galley.records.store.store import Store
    from galley.server.researcher.passwords import Passwords, checked_name
    from galley.workspace import Workspace

    kept = checked_name(name)
    if sys.stdin.isatty():
        password = typer.prompt("Password", hide_input=True, confirmation_prompt=True)
    else:
        password = sys.stdin.readline().rstrip("\r\n")
    hashed = Passwords().hashed(password)
    with Store.open(database or Workspace(workspace).database) as store:
        researchers = Researchers(store)
        known = researchers.find(kept).result()
        researchers.put(kept, hashed, time.time() * 1000).result()
    typer.echo(f"{kept} {'was added' if known is None else 'has a new password'}; log in at /researcher")


@app.command("list")
def list_(workspace: WorkspaceOption = Path(), database: DatabaseOption = None) -> None:
    """Print the names of all researchers, one a line."""
    from galley.records.store.researcher_accounts import Researchers
    from galley.records.store.store import Store
    from galley.workspace import Workspace

    with Store.open(database or Workspace(workspace).database, must_exist=True) as store:
        for researcher in Researchers(store).all().result():
            typer.echo(researcher.name)


@app.command()
def remove(name: NameArgument, workspace: WorkspaceOption = Path(), database: DatabaseOption = None) -> None:
    """Remove a researcher and end their logins; what they did stays."""
    from galley.errors import GalleyError
    from galley.names import name_fix
    from galley.records.store.researcher_accounts import Researchers
    from galley.records.store.store import Store
    from galley.workspace import Workspace

    with Store.open(database or Workspace(workspace).database, must_exist=True) as store:
        researchers = Researchers(store)
        names = [researcher.name for researcher in researchers.all().result()]
        if name not in names:
            raise GalleyError(f"there is no researcher {name!r}; {name_fix(name, names)}")
        researchers.remove(name).result()
    typer.echo(f"{name} was removed")
