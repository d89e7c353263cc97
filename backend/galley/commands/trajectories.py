"""`galley trajectories`: recorded games read, replayed and measured."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from galley.commands.options import DatabaseOption, JsonOption, WorkspaceOption

if TYPE_CHECKING:
    from galley.datasets.lsi_study import StudyGame

app = typer.Typer(help="Recorded games: import, verify, measure, draw.", no_args_is_help=True)


@app.command("import")
def import_files(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Pickles of human games; .csv of the LSI study or of `galley export --human-data`.",
        ),
    ],
    json_: JsonOption = False,
) -> None:
    """Replay recorded games and compare: every transition, or the figures of the LSI study."""
    from galley.datasets.kinds_of_files import CSV_READERS, csv_kind
    from galley.datasets.lsi_study import read_games
    from galley.datasets.overcooked_games import ImportReport
    from galley.datasets.overcooked_games import import_files as read
    from galley.errors import GalleyError

    wrong: list[str] = []
    report = ImportReport(0, 0, 0, 0)
    games: list[StudyGame] = []
    for file in files:
        try:
            kind = csv_kind(file) if file.suffix.lower() == ".csv" else "pickle"
            if kind == "study":
                games += read_games(file)
            else:
                report += read([file], CSV_READERS.get(kind))
        except GalleyError as error:
            wrong.append(str(error))
    as_recorded = not games or _told_study(games, json_)
    if report.games:
        figures = {
            "games": report.games,
            "transitions": report.transitions,
            "matched": report.matched,
            "mismatched": report.mismatched,
        }
        words = " ".join(f"{key}={value}" for key, value in figures.items())
        typer.echo(json.dumps(figures) if json_ else words)
    if wrong:
        raise GalleyError("\n".join(wrong))
    if report.mismatched or not as_recorded:
        raise typer.Exit(1)


def _told_study(games: Sequence[StudyGame], json_: bool) -> bool:
    """Print how each game of the LSI study compares; whether all are as recorded."""
    different = 0
    for game in games:
        told = game.differences()
        different += bool(told)
        row = {"game": game.place, "layout": game.name, **asdict(game.recomputed()), "differences": told}
        if json_:
            typer.echo(json.dumps(row))
        else:
            typer.echo(f"{game.place} {game.name}: {'; '.join(told) or 'as recorded'}")
    figures = {"games": len(games), "equal": len(games) - different, "different": different}
    typer.echo(json.dumps(figures) if json_ else " ".join(f"{key}={value}" for key, value in figures.items()))
    return not different


@app.command()
def verify(
    study: Annotated[str, typer.Argument(help="Name of the study.")],
    workspace: WorkspaceOption = Path(),
    database: DatabaseOption = None,
) -> None:
    """Replay every stored round of a study and compare it bit for bit with what was stored."""
    from galley.records.reading.verify import verify_study
    from galley.records.store.store import Store
    from galley.workspace import Workspace

    store = Store.open(database or Workspace(workspace).database, must_exist=True)
    try:
        report = verify_study(store, study)
    finally:
        store.close()
    typer.echo(str(report))
    if not report.ok:
        raise typer.Exit(1)


@app.command()
def measure(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Trajectory files (JSON Lines).")],
    json_: JsonOption = False,
) -> None:
    """Print score, deliveries, workload, concurrent motion and stuck ticks of each trajectory."""
    from galley.kitchen.measures import measures
    from galley.kitchen.trajectory import read

    for file in files:
        trajectory = read(file)
        figures = {"file": str(file), **asdict(measures(trajectory))}
        typer.echo(json.dumps(figures) if json_ else " ".join(f"{k}={v}" for k, v in figures.items()))


@app.command()
def draw(
    out: Annotated[Path, typer.Option(metavar="FILE", help="Film to write: .gif or .mp4.")],
    source: Annotated[
        Path | None, typer.Argument(metavar="[SOURCE]", help="Trajectory file (JSON Lines).")
    ] = None,
    round_: Annotated[
        int | None, typer.Option("--round", metavar="ID", help="Number of a round in the records instead.")
    ] = None,
    scale: Annotated[int, typer.Option(help="Edge of a tile in pixels.")] = 48,
    speed: Annotated[float, typer.Option(help="Times as fast as it was played.")] = 1.0,
    workspace: WorkspaceOption = Path(),
    database: DatabaseOption = None,
) -> None:
    """Draw a round as participants saw it, as GIF or MP4. Needs the extra `video`."""
    from galley.errors import GalleyError
    from galley.film.footage import footage
    from galley.film.write import check, write_film
    from galley.kitchen.trajectory import read
    from galley.workspace import Workspace, frontend_folder

    if (source is None) == (round_ is None):
        raise GalleyError("draw one round: name a trajectory file, or a round of the records with --round ID")
    check(out, scale, speed)
    if source is not None:
        filmed = footage([read(source)], str(source))
    else:
        from galley.records.reading.films import footage_of_round
        from galley.records.store.store import Store

        with Store.open(database or Workspace(workspace).database, must_exist=True) as store:
            filmed = footage_of_round(store, round_ or 0)
    count = write_film(filmed, frontend_folder() / "sprites", out, scale, speed)
    typer.echo(f"{out}: {count} pictures of {filmed.ticks} ticks")
