"""`galley learn bc`: clones of human players as an agent."""

from __future__ import annotations

import importlib.util
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import WorkspaceOption
from galley.errors import GalleyError


class Split(StrEnum):
    """Which of the published human games to learn from."""

    train = "train"
    test = "test"


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
    from galley.learning.cloning.clone_card import SEED
    from galley.learning.cloning.clones import learn_bc

    seed = SEED if seed is None else seed
    learn_bc(workspace, data=data, split=split.value, seed=seed, games=games, out=out, tell=typer.echo)
