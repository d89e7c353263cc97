"""`galley simulate`: participants who are not there, for piloting and for load."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import JsonOption, WorkspaceOption


def simulate(
    study: Annotated[str, typer.Argument(help="Name of the study.")],
    participants: Annotated[int, typer.Option(min=1, help="How many take part.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Seed of what they answer and do.")] = 0,
    url: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help="Server that serves the study. Visits there count like everybody's.",
            show_default="a server of its own, whose records are not kept",
        ),
    ] = None,
    dropout: Annotated[
        float, typer.Option(min=0, max=1, metavar="P", help="Probability that somebody leaves half-way.")
    ] = 0.0,
    in_flight: Annotated[int, typer.Option(min=1, metavar="K", help="How many are there at a time.")] = 10,
    agent: Annotated[str, typer.Option(metavar="NAME", help="Agent that plays as the human.")] = "myopic",
    delay_ms: Annotated[
        float, typer.Option(min=0, metavar="D", help="Network delay to add, each way, ms.")
    ] = 0.0,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="New folder for an export of the simulated people, marked as such.",
        ),
    ] = None,
    workspace: WorkspaceOption = Path(),
    json_: JsonOption = False,
) -> None:
    """Let simulated participants walk through a study; print how it went. Exits with 1 when a visit broke.

    Without --url the study's own records stay as they are, with --out too.
    """
    from galley.progress_lines import ProgressLines
    from galley.simulate.results import in_words
    from galley.simulate.simulation import Simulation
    from galley.simulate.simulation import simulate as run
    from galley.workspace import Workspace

    if out is not None and url is not None:
        raise typer.BadParameter("it needs a server of its own; leave --url out", param_hint="--out")
    if out is not None:
        os.umask(0o077)
    # What was begun is taken away then as after Ctrl-C.
    signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    wanted = Simulation(study, participants, seed, dropout, in_flight, agent, delay_ms)
    report = run(Workspace(workspace), wanted, url, out, ProgressLines())
    typer.echo(json.dumps(report) if json_ else in_words(report))
    if report["errors"]:
        raise typer.Exit(1)
