"""`galley agents`: the bundles of a workspace listed, checked and played."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import JsonOption, WorkspaceOption
from galley.errors import InvalidFiles

app = typer.Typer(help="Agents: list, check, play.", no_args_is_help=True)


@app.command("list")
def list_agents(workspace: WorkspaceOption = Path(), json_: JsonOption = False) -> None:
    """List the agents of a workspace with their kind and layouts."""
    from galley.agents.catalogue import Catalogue
    from galley.workspace import Workspace

    catalogue = Catalogue(Workspace(workspace))
    for name in catalogue.names():
        bundle = catalogue.bundle(name)
        layouts = "any" if bundle.layouts is None else sorted(bundle.layouts)
        row = {"name": name, "kind": bundle.kind, "layouts": layouts, "sha256": bundle.sha256}
        shown = layouts if isinstance(layouts, str) else ", ".join(layouts)
        typer.echo(json.dumps(row) if json_ else f"{name:16} {bundle.kind:9} {shown}")


@app.command()
def check(workspace: WorkspaceOption = Path()) -> None:
    """Load and try every bundle; name wrong shapes, NaNs, missing layouts and slow agents."""
    from galley.agents.catalogue import Catalogue
    from galley.workspace import Workspace

    catalogue = Catalogue(Workspace(workspace))
    problems = catalogue.check()
    if problems:
        raise InvalidFiles(problems)
    typer.echo(f"No problems in {len(catalogue.names())} agents.")


@app.command()
def play(
    first: Annotated[str, typer.Argument(metavar="A", help="Name of an agent.")],
    second: Annotated[str, typer.Argument(metavar="B", help="Name of its partner.")],
    layout: Annotated[str, typer.Option(metavar="NAME", help="Layout to play on.")],
    games: Annotated[int, typer.Option(min=1, help="Games for each seat order.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of the first game.")] = 0,
    workspace: WorkspaceOption = Path(),
    json_: JsonOption = False,
) -> None:
    """Let two agents play each other in both seat orders; print mean scores and standard errors."""
    from galley.agents.catalogue import Catalogue
    from galley.agents.play import play as play_games
    from galley.kitchen.layout_file import find_layout
    from galley.workspace import Workspace

    place = Workspace(workspace)
    catalogue = Catalogue(place)
    results = play_games(
        catalogue.bundle(first), catalogue.bundle(second), find_layout(place, layout), games=games, seed=seed
    )
    for result in results:
        row = {
            "seats": [result.seat_0, result.seat_1],
            "layout": layout,
            "games": games,
            "seed": seed,
            "mean": result.mean,
            "standard_error": result.standard_error,
        }
        line = (
            f"{result.seat_0} + {result.seat_1} on {layout}: {result.mean:.1f} ± {result.standard_error:.1f}"
        )
        typer.echo(json.dumps(row) if json_ else line)
