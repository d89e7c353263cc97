"""`galley learn`: agents made from data and by training, judged and drawn."""

from __future__ import annotations

import typer

from galley.commands.learn import bc, evaluate, plot, train

HELP = (
    "Make agents and judge them. Training needs PyTorch (pip install 'galley[learn]'), evaluate nothing "
    "more, plot needs Matplotlib (pip install 'galley[plot]')."
)

app = typer.Typer(help=HELP, no_args_is_help=True)
app.command()(train.train)
app.command()(train.export)
app.command()(train.payoffs)
app.command()(evaluate.evaluate)
app.add_typer(plot.app, name="plot")
app.command()(bc.bc)


@app.callback(help=HELP)
def _learn() -> None:
    """Make agents and judge them."""
