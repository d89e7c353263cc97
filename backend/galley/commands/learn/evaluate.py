"""`galley learn evaluate`: how well agents cook with each other and with strangers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import JsonOption, WorkspaceOption


def evaluate(
    agents: Annotated[
        list[str],
        typer.Argument(
            metavar="AGENT...",
            help="Names of agents or folders of bundles (with a /); LABEL=NAME,NAME for seeds of one method.",
        ),
    ],
    partner: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AGENT",
            help="A partner of them all, once for each. By human-proxy nothing may be chosen.",
            show_default="each other",
        ),
    ] = None,
    layout: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="A layout to play on, once for each.", show_default="all that they know"
        ),
    ] = None,
    itself: Annotated[
        bool, typer.Option("--itself", help="With --partner: play every agent with itself too.")
    ] = False,
    games: Annotated[int, typer.Option(min=1, help="Games for each seat order.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all games.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes on this machine.")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(metavar="URL", help="Dask scheduler to use instead, for more machines.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Keep every game's score here (JSON); what is there is not replayed."
        ),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a row for each seat order here (CSV).")
    ] = None,
    workspace: WorkspaceOption = Path(),
    json_: JsonOption = False,
) -> None:
    """Play agents with each other or with partners, in both seats; print the paper's tables."""
    from galley.evaluation.agent_groups import agent_groups
    from galley.evaluation.crossplay import Roster, find_layouts, pairings, play_cells
    from galley.evaluation.game_scores import Cell, GameScores
    from galley.evaluation.score_tables import as_rows, report

    rows = agent_groups(agents)
    columns = None if not partner else agent_groups(partner)
    pairs = pairings(rows, columns, itself)
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    layouts = find_layouts(workspace, Roster(workspace), names, layout or [])
    results = GameScores.load(out) if out is not None and out.is_file() else GameScores()
    with typer.progressbar(
        length=len(layouts) * len(pairs), label="seat orders", file=typer.get_text_stream("stderr")
    ) as bar:

        def keep(cell: Cell) -> None:
            bar.update(1)
            if out is not None:
                results.save(out)

        play_cells(
            results,
            layouts,
            pairs,
            workspace=workspace,
            games=games,
            seed=seed,
            workers=workers,
            scheduler=scheduler,
            on_start=lambda cells: bar.update(len(layouts) * len(pairs) - cells),
            on_done=keep,
        )
    if csv is not None:
        results.save_csv(csv)
    listed = [layout.name for layout in layouts]
    if json_:
        for row in as_rows(results, listed, rows, columns, itself):
            typer.echo(json.dumps(row))
        return
    played = {len(results.cell(name, *pair).scores) for name in listed for pair in pairs}
    told = " to ".join(str(number) for number in sorted({min(played), max(played)}))
    typer.echo(f"{told} games for each seat order, seed {seed}\n")
    typer.echo(report(results, listed, rows, columns, itself))
