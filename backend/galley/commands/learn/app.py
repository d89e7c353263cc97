"""`galley learn`: agents made from data and by training, judged and drawn."""

from __future__ import annotations

import typer

from galley.commands.learn import bc, evaluate, plot, train

app = typer.Typer(help="Make agents (needs PyTorch: pip install 'galley[learn]').", no_args_is_help=True)
app.command()(train.train)
app.command()(train.export)
app.command()(train.payoffs)
app.command()(evaluate.evaluate)
app.add_typer(plot.app, name="plot")
app.command()(bc.bc)


@app.callback()
def _learn() -> None:
    """Make agents (needs PyTorch: pip install 'galley[learn]')."""
