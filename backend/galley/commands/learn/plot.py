"""`galley learn plot`: results and runs as figures."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Annotated

import typer

from galley.errors import GalleyError

app = typer.Typer(help="Draw results and runs as figures (.svg, .pdf or .png).", no_args_is_help=True)

OutOption = Annotated[
    Path, typer.Option(metavar="FILE", help="The figure; its ending says how: .svg, .pdf or .png.")
]
LayoutsOption = Annotated[
    list[str] | None,
    typer.Option("--layout", metavar="NAME", help="A layout, once for each.", show_default="all in RESULTS"),
]
LayoutOption = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="The layout, of results with several.", show_default="the only one"),
]
AgentsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--agent",
        metavar="NAME",
        help="A strategy to show, once for each, in this order.",
        show_default="all",
    ),
]


@app.callback()
def _plot() -> None:
    """Draw results and runs as figures (.svg, .pdf or .png)."""


@app.command()
def bars(
    results: Annotated[Path, typer.Argument(help="What galley learn evaluate kept with --out.")],
    partner: Annotated[
        str, typer.Option(metavar="AGENT", help="The partner of the bars: NAME or LABEL=NAME,NAME.")
    ],
    out: OutOption,
    agent: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AGENT",
            help="An agent, once for each: NAME or LABEL=NAME,NAME.",
            show_default="all that played the partner",
        ),
    ] = None,
    layout: LayoutsOption = None,
    itself: Annotated[bool, typer.Option("--itself", help="Self-play as grey bars behind.")] = False,
) -> None:
    """Draw scores with a partner as bars with standard errors, by layout and seat (as Fig. 7, 9, 11)."""
    _require_drawing(out)
    from galley.evaluation.agent_groups import agent_group, agent_groups
    from galley.evaluation.game_scores import GameScores
    from galley.learning.plots.bars import draw_bars
    from galley.plot_style import save

    kept = GameScores.load(results)
    beside = agent_group(partner)
    found = [cell.seat_0 for cell in kept if cell.seat_1 in beside.members]
    named = agent or [name for name in dict.fromkeys(found) if name not in beside.members]
    if not named:
        raise GalleyError(
            f"{results}: nobody was played with {partner}; play them with galley learn evaluate"
        )
    save(draw_bars(kept, layout or kept.layouts, agent_groups(named), beside, itself), out)


@app.command()
def matrices(
    tables: Annotated[
        list[str],
        typer.Argument(metavar="TABLE...", help="Payoffs: FILE or TITLE=FILE, a run's .npz or RESULTS.json."),
    ],
    out: OutOption,
    layout: LayoutOption = None,
    agent: AgentsOption = None,
) -> None:
    """Draw payoffs and preference centralities as squares (as Fig. 2b, 10); print the mean of the newest."""
    _require_drawing(out)
    from galley.evaluation.agent_groups import agent_groups
    from galley.evaluation.game_graph import centrality_matrix, newest_centralities
    from galley.learning.plots.matrices import draw_matrices
    from galley.learning.plots.sources import read_payoffs
    from galley.plot_style import save

    found = [
        (one.label.removesuffix(Path(file).suffix), read_payoffs(Path(file), layout, agent or ()))
        for one in agent_groups(tables)
        for file in one.members
    ]
    save(draw_matrices(found), out)
    for title, table in found:
        newest = newest_centralities(centrality_matrix(table.payoffs()))
        if len(newest):
            typer.echo(f"{title}: mean preference centrality of {len(newest)} newest {newest.mean():.3f}")


@app.command()
def graphs(
    table: Annotated[Path, typer.Argument(help="Payoffs: a run's .npz or RESULTS.json.")],
    out: OutOption,
    step: Annotated[
        list[int] | None,
        typer.Option(
            help="Draw preferences among the first N, once for each.", show_default="four, evenly spread"
        ),
    ] = None,
    layout: LayoutOption = None,
    agent: AgentsOption = None,
) -> None:
    """Draw the game graph and the preference graphs of a growing population (as Fig. 1)."""
    _require_drawing(out)
    from galley.learning.plots.graphs import draw_graphs
    from galley.learning.plots.sources import read_payoffs
    from galley.plot_style import save

    save(draw_graphs(read_payoffs(table, layout, agent or ()), step), out)


@app.command()
def curves(
    runs: Annotated[
        list[str],
        typer.Argument(
            metavar="RUN...",
            help="Folders with log.csv, or CSV files; LABEL=RUN,RUN for seeds of one method.",
        ),
    ],
    out: OutOption,
    column: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="A column of the log, once for each.", show_default="score"),
    ] = None,
    against: Annotated[str, typer.Option(metavar="NAME", help="The column to the right.")] = "ticks",
    smooth: Annotated[int, typer.Option(min=1, help="Average as many rows of the log.")] = 1,
) -> None:
    """Draw columns of the logs of runs against ticks; several runs of one label as their mean in a band."""
    _require_drawing(out)
    from galley.evaluation.agent_groups import agent_groups
    from galley.learning.plots.curves import draw_curves
    from galley.plot_style import save

    save(draw_curves(agent_groups(runs), column or ["score"], against, smooth), out)


def _require_drawing(out: Path) -> None:
    missing = [name for name in ("matplotlib", "networkx") if importlib.util.find_spec(name) is None]
    if missing:
        raise GalleyError(f"drawing needs {', '.join(missing)}; install: pip install 'galley[plot]'")
    from galley.plot_style import require_ending

    require_ending(out)
