"""`galley learn train`: partners trained by self-play and by populations."""

from __future__ import annotations

import inspect
import os
from collections.abc import Iterator
from dataclasses import MISSING
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from galley.commands.options import WorkspaceOption
from galley.learning.methods.table import METHODS
from galley.learning.options import TrainingOptions, asked_options


def _parameters() -> Iterator[inspect.Parameter]:
    """The parameters of `galley learn train`: the method and a row of the table of options each."""
    kinds = get_type_hints(TrainingOptions)
    names = StrEnum("Method", {name: name for name in METHODS})  # type: ignore[misc]  # mypy wants a literal
    named = typer.Argument(metavar="METHOD", help="How to train: a method of docs/learning.md.")
    yield inspect.Parameter("method", inspect.Parameter.KEYWORD_ONLY, annotation=Annotated[names, named])
    for name, (field, option) in asked_options().items():
        kind, default = (kinds[name], field.default) if option.kind is None else (option.kind, None)
        told = typer.Option(
            option.flag, metavar=option.metavar, min=option.least, help=option.help,
            show_default=option.shown_default or True,
        )  # fmt: skip
        yield inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if default is MISSING else False if kind is bool else default,
            annotation=Annotated[kind, told],
        )
    out = typer.Option(metavar="DIR", help="Folder of the run.", show_default="runs/METHOD-LAYOUT-SEED")
    yield inspect.Parameter(
        "out", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[Path | None, out]
    )
    yield inspect.Parameter(
        "workspace", inspect.Parameter.KEYWORD_ONLY, default=Path(), annotation=WorkspaceOption
    )


def train(*, method: str, out: Path | None, workspace: Path, **given: Any) -> None:
    """Train a partner; the same command goes on with a run that was stopped."""
    from galley.kitchen.layout_file import find_layout
    from galley.learning.training_run import train_run
    from galley.workspace import Workspace

    place = Workspace(workspace)
    layout = find_layout(place, given["layout"])
    values = {name: option.value(given[name]) for name, (_, option) in asked_options().items()}
    options = TrainingOptions(**{**values, "method": str(method), "layout": layout.name})
    path = out or place.path / "runs" / f"{method}-{layout.name}-{options.seed}"
    train_run(options, layout, path)
    typer.echo(f"{path}: done; make an agent of it with: galley learn export {path} --name {method}")


_SIGNATURE = inspect.Signature([*_parameters()])
train.__signature__ = _SIGNATURE  # type: ignore[attr-defined]  # which Typer reads
train.__annotations__ = {name: one.annotation for name, one in _SIGNATURE.parameters.items()}


def export(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Folders of finished runs.")],
    name: Annotated[str, typer.Option(metavar="NAME", help="Name of the agent.")],
    member: Annotated[
        str,
        typer.Option(metavar="MEMBER", help="Another policy of the runs, such as 0040.", show_default="last"),
    ] = "best",
    unstuck: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="TICKS", help="Bar what was done while stuck so long.", show_default="never"
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the measuring games.")] = 0,
    workspace: WorkspaceOption = Path(),
) -> None:
    """Make an agent of finished runs, one for each layout; measure it and write its card."""
    from galley.learning.bundles.from_runs import export as make_bundle

    bundle = make_bundle(
        workspace, runs, name, member=member, unstuck_after_ticks=unstuck, seed=seed, tell=typer.echo
    )
    typer.echo(f"{bundle.path}: written; galley agents check tries it")


def payoffs(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a finished run.")],
    games: Annotated[int, typer.Option(min=1, metavar="N", help="Games of a pair in each seat order.")] = 5,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of all games.")] = 0,
    workspace: WorkspaceOption = Path(),
) -> None:
    """Play the checkpoints of a run with each other, for galley learn plot matrices and graphs."""
    from galley.learning.checkpoint_payoffs import checkpoint_payoffs

    with typer.progressbar(length=100) as bar:
        checkpoint_payoffs(
            workspace, run, games=games, seed=seed, threads=os.cpu_count() or 1,
            tell=lambda done, total: bar.update(100 * done // total - bar.pos),
        )  # fmt: skip
    typer.echo(f"{run / 'payoffs.npz'}: written")
