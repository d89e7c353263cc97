"""`galley learn train`: partners trained by self-play and by populations."""

from __future__ import annotations

import os
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from galley.commands.options import WorkspaceOption


class Method(StrEnum):
    """How a partner is trained."""

    sp = "sp"
    pbt = "pbt"
    fcp = "fcp"
    mep = "mep"
    cole_sv = "cole-sv"
    cole_r = "cole-r"


def train(
    method: Annotated[Method, typer.Argument(metavar="METHOD", help="sp pbt fcp mep cole-sv cole-r")],
    layout: Annotated[str, typer.Option(metavar="NAME", help="Layout to train on.")],
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of everything in the run.")] = 0,
    quick: Annotated[
        bool, typer.Option("--quick", help="Larger steps than the papers', for a fifth of the ticks.")
    ] = False,
    scale: Annotated[
        float, typer.Option(metavar="X", help="Share of the papers' ticks (COLE: generations).")
    ] = 1.0,
    ratio: Annotated[
        str, typer.Option(metavar="A:B", help="COLE: kitchens with itself : with others.")
    ] = "1:3",
    partners: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="COLE: partners drawn for an update.", show_default="B"),
    ] = None,
    generations: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="COLE: generations, whatever the scale.")
    ] = None,
    generation_updates: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="COLE: updates of a generation.", show_default="10")
    ] = None,
    population: Annotated[
        int | None,
        typer.Option(metavar="N", help="PBT, FCP, MEP: policies in the population.", show_default="3, 8, 5"),
    ] = None,
    pool: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RUN", help="FCP, COLE: a finished run of sp for the first population, once each."
        ),
    ] = None,
    response: Annotated[
        float, typer.Option(metavar="X", help="FCP, MEP: ticks of the best response for one of a member.")
    ] = 2.0,
    no_wpg: Annotated[
        bool, typer.Option("--no-wpg", help="COLE: leave the weighted PageRank out (ablation).")
    ] = False,
    no_sucg: Annotated[
        bool, typer.Option("--no-sucg", help="COLE: draw partners by the solver alone (ablation).")
    ] = False,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Change a constant of PPO.")
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="Threads; other numbers round differently.", show_default="all"
        ),
    ] = None,
    device: Annotated[str, typer.Option(metavar="NAME", help="cpu or cuda.")] = "cpu",
    bf16: Annotated[
        bool, typer.Option("--bf16", help="Networks in bfloat16, where the processor has it.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the run.", show_default="runs/METHOD-LAYOUT-SEED"),
    ] = None,
    workspace: WorkspaceOption = Path(),
) -> None:
    """Train a partner; the same command goes on with a run that was stopped."""
    from galley.kitchen.layout_file import find_layout
    from galley.learning.asked import Asked, parsed_changes
    from galley.learning.methods.cole import ColeSettings
    from galley.learning.train import train_run
    from galley.workspace import Workspace

    place = Workspace(workspace)
    kitchen = find_layout(place, layout)
    asked = Asked(
        method=method.value,
        layout=kitchen.name,
        seed=seed,
        quick=quick,
        scale=scale,
        ratio=ratio,
        partners=partners,
        weighted=not no_wpg,
        exploration=0.0 if no_sucg else ColeSettings.exploration,
        generations=generations,
        generation_updates=generation_updates,
        population=population,
        pool=tuple(pool or ()),
        response=response,
        changes=parsed_changes(set_ or ()),
        threads=threads or os.cpu_count() or 1,
        device=device,
        bf16=bf16,
    )
    path = out or place.path / "runs" / f"{method.value}-{kitchen.name}-{seed}"
    train_run(asked, kitchen, path)
    typer.echo(f"{path}: done; make an agent of it with: galley learn export {path} --name {method.value}")


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
    from galley.learning.run_payoffs import run_payoffs

    with typer.progressbar(length=100) as bar:
        run_payoffs(
            workspace, run, games=games, seed=seed, threads=os.cpu_count() or 1,
            tell=lambda done, total: bar.update(100 * done // total - bar.pos),
        )  # fmt: skip
    typer.echo(f"{run / 'payoffs.npz'}: written")
