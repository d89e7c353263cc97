"""`galley learn`: agents made from data (needs the extra `learn`)."""

from __future__ import annotations

import importlib.util
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from galley.commands import learn_evaluate, learn_plot, learn_train
from galley.commands.options import WorkspaceOption
from galley.errors import GalleyError

app = typer.Typer(help="Make agents (needs PyTorch: pip install 'galley[learn]').", no_args_is_help=True)
app.command()(learn_train.train)
app.command()(learn_train.export)
app.command()(learn_train.payoffs)
app.command()(learn_evaluate.evaluate)
app.add_typer(learn_plot.app, name="plot")


class Split(StrEnum):
    """Which of the published human games to learn from."""

    train = "train"
    test = "test"


@app.callback()
def _learn() -> None:
    """Make agents (needs PyTorch: pip install 'galley[learn]')."""


@app.command()
def bc(
    data: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="Pickle of human games, or the folder that holds both.",
            show_default=".cache/overcooked-ai in the workspace",
        ),
    ] = None,
    split: Annotated[
        Split, typer.Option(metavar="SPLIT", help="train makes human-bc, test makes human-proxy.")
    ] = Split.train,
    seed: Annotated[
        int | None,
        typer.Option(metavar="N", help="Seed of the training.", show_default="that of the bundles here"),
    ] = None,
    games: Annotated[int, typer.Option(min=1, help="Games that measure the result.")] = 100,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the bundle.", show_default="agents/ in the workspace"),
    ] = None,
    workspace: WorkspaceOption = Path(),
) -> None:
    """Clone human players on each layout and export the result as an agent."""
    missing = [name for name in ("torch", "onnx", "tqdm") if importlib.util.find_spec(name) is None]
    if missing:
        raise GalleyError(f"galley learn needs {', '.join(missing)}; install: pip install 'galley[learn]'")
    from galley.learning.bc import learn_bc
    from galley.learning.card import SEED

    seed = SEED if seed is None else seed
    learn_bc(workspace, data=data, split=split.value, seed=seed, games=games, out=out, tell=typer.echo)
