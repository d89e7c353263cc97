"""`galley evaluate`: kitchens judged by how a robot and a simulated human cook in them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import JsonOption, WorkspaceOption
from galley.errors import GalleyError


def evaluate(
    layouts: Annotated[
        list[str], typer.Argument(metavar="LAYOUT...", help="Names of layouts, or layout files (.yaml).")
    ],
    robot: Annotated[str, typer.Option(help="Agent that is the robot.")] = "qmdp",
    human: Annotated[str, typer.Option(help="Agent that is the simulated human.")] = "myopic",
    epsilon: Annotated[float, typer.Option(min=0, max=1, help="Share of random actions of the human.")] = 0.0,
    trials: Annotated[int, typer.Option(min=1, help="Trials on each layout.")] = 50,
    horizon: Annotated[int, typer.Option(min=1, max=32_000, help="Ticks of a trial.")] = 100,
    orders: Annotated[
        str | None,
        typer.Option(
            help="Order list such as onion,tomato; none for no list.",
            show_default="the layout's, else onion,onion",
        ),
    ] = None,
    seat: Annotated[int, typer.Option(min=0, max=1, help="Seat of the robot.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all trials.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes on this machine.")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(metavar="URL", help="Dask scheduler to use instead, for more machines.")
    ] = None,
    workspace: WorkspaceOption = Path(),
    json_: JsonOption = False,
) -> None:
    """Let a robot and a simulated human cook many times; print the median and spread of each measure."""
    from galley.evaluation.many_layouts import evaluate_many
    from galley.evaluation.teams import Team
    from galley.kitchen.layout_file import find_layout, load_layout
    from galley.workspace import Workspace

    listed = None
    if orders is not None:
        listed = () if orders == "none" else tuple(order.strip() for order in orders.split(","))
    team = Team(robot, human, epsilon, trials, horizon, seed, seat, listed, str(workspace.resolve()))
    home = Workspace(workspace)
    kitchens = []
    for name in layouts:
        if name.endswith((".yaml", ".yml")):
            if not Path(name).is_file():
                raise GalleyError(f"{name}: no such file; give a layout's name or its file")
            kitchens.append(load_layout(Path(name)))
        else:
            kitchens.append(find_layout(home, name))
    with typer.progressbar(
        length=len(kitchens), label="layouts", file=typer.get_text_stream("stderr")
    ) as bar:
        answers = evaluate_many(kitchens, team, workers, scheduler, lambda done: bar.update(1))
    for answer in answers:
        if json_:
            typer.echo(json.dumps(answer))
            continue
        typer.echo(f"{answer['layout']}: {robot} and {human}, {trials} trials of {horizon} ticks")
        for name, spread in answer["measures"].items():
            typer.echo(
                f"  {name:24} {spread['median']:8.3f}"
                f"   quartiles {spread['lower']:.3f} to {spread['upper']:.3f}"
                f"   all {spread['least']:.3f} to {spread['most']:.3f}"
            )
