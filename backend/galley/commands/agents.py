"""`galley agents`: the bundles of a workspace listed, checked, played and added."""

from __future__ import annotations

import importlib.util
import json
import shlex
import sys
import zipfile
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from galley.commands.options import JsonOption, WorkspaceOption
from galley.errors import GalleyError, InvalidFiles, Problem

if TYPE_CHECKING:
    from galley.agents.admission.adding import Converted

app = typer.Typer(help="Agents: list, check, play, add.", no_args_is_help=True)


CONVERT_S: Final = 300
"""For so long a network's own program may run while it is made into ONNX."""


class Origin(StrEnum):
    """What the files of a newcomer are."""

    onnx = "onnx"
    torchscript = "torchscript"
    state_dict = "state-dict"


class Sampling(StrEnum):
    """How a network's agent takes its actions."""

    sample = "sample"
    argmax = "argmax"


@app.command("list")
def list_agents(workspace: WorkspaceOption = Path(), json_: JsonOption = False) -> None:
    """List the agents of a workspace with their kind and layouts."""
    from galley.agents.catalogue import Catalogue
    from galley.workspace import Workspace

    catalogue = Catalogue(Workspace(workspace))
    for name in catalogue.names():
        bundle = catalogue.bundle(name)
        layouts = "any" if bundle.layouts is None else sorted(bundle.layouts)
        row = {"name": name, "kind": bundle.kind, "layouts": layouts, "sha256": bundle.sha256}
        shown = layouts if isinstance(layouts, str) else ", ".join(layouts)
        typer.echo(json.dumps(row) if json_ else f"{name:16} {bundle.kind:9} {shown}")


@app.command()
def check(workspace: WorkspaceOption = Path()) -> None:
    """Load and try every bundle; name wrong shapes, NaNs, missing layouts and slow agents."""
    from galley.agents.catalogue import Catalogue
    from galley.agents.network import DECISION_S
    from galley.progress_lines import ProgressLines
    from galley.workspace import Workspace

    catalogue = Catalogue(Workspace(workspace), DECISION_S)
    problems = catalogue.check(ProgressLines())
    if problems:
        raise InvalidFiles(problems)
    typer.echo(f"No problems in {len(catalogue.names())} agents.")


@app.command()
def play(
    first: Annotated[str, typer.Argument(metavar="A", help="Name of an agent.")],
    second: Annotated[str, typer.Argument(metavar="B", help="Name of its partner.")],
    layout: Annotated[str, typer.Option(metavar="NAME", help="Layout to play on.")],
    games: Annotated[int, typer.Option(min=1, help="Games for each seat order.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of the first game.")] = 0,
    workspace: WorkspaceOption = Path(),
    json_: JsonOption = False,
) -> None:
    """Let two agents play each other in both seat orders; print mean scores and standard errors."""
    from galley.agents.catalogue import Catalogue
    from galley.agents.episode import play_both_orders
    from galley.agents.network import DECISION_S
    from galley.evaluation.game_scores import MeanScore
    from galley.kitchen.layout_file import find_layout
    from galley.workspace import Workspace

    place = Workspace(workspace)
    catalogue = Catalogue(place, DECISION_S)
    bundles = catalogue.bundle(first), catalogue.bundle(second)
    both = play_both_orders(*bundles, find_layout(place, layout), games, seed)
    for seats, scores in zip(((first, second), (second, first)), both, strict=True):
        figure = MeanScore.of(scores)
        row = {
            "seats": seats,
            "layout": layout,
            "games": games,
            "seed": seed,
            "mean": figure.mean,
            "standard_error": figure.standard_error,
        }
        line = f"{' + '.join(seats)} on {layout}: {figure.mean:.1f} ± {figure.standard_error:.1f}"
        typer.echo(json.dumps(row) if json_ else line)


@app.command()
def add(
    name: Annotated[str, typer.Option(metavar="NAME", help="Name of the new agent.")],
    encoding: Annotated[str, typer.Option(metavar="NAME", help="Encoding of its observations.")],
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FILE...", help="Networks; none needed where every --layout names its own."),
    ] = None,
    layout: Annotated[
        list[str] | None,
        typer.Option(
            metavar="L[=FILE]",
            help="A layout it plays on, once for each; its file if not the one FILE, or the FILE called L.",
            show_default="the names of the files",
        ),
    ] = None,
    sampling: Annotated[
        Sampling, typer.Option(metavar="HOW", help="sample draws actions, argmax takes the most probable.")
    ] = Sampling.sample,
    unstuck: Annotated[
        str, typer.Option(metavar="N|none", help="Bar repeated actions after N ticks in one pose.")
    ] = "none",
    from_: Annotated[
        Origin,
        typer.Option(
            "--from",
            metavar="KIND",
            help="onnx, torchscript (a program: it is run) or state-dict (with --network).",
        ),
    ] = Origin.onnx,
    network: Annotated[
        str | None,
        typer.Option(
            metavar="NETWORK",
            help="For a state dict: cole-cnn, bc-mlp, a YAML or JSON file, or module:Class (imports it).",
        ),
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite the agent of this name.")] = False,
    workspace: WorkspaceOption = Path(),
    json_: JsonOption = False,
) -> None:
    """Let a network in as an agent if it passes the gate; else tell every reason and leave all as it was."""
    from galley.agents.admission.adding import Newcomer, add_network
    from galley.progress_lines import ProgressLines, ends_within
    from galley.workspace import Workspace

    if (from_ is Origin.state_dict) != (network is not None):
        raise typer.BadParameter("a state dict needs it, and nothing else takes it", param_hint="--network")
    if unstuck != "none" and not (unstuck.isdecimal() and 1 <= int(unstuck) <= 100):
        raise typer.BadParameter("a number of ticks from 1 to 100, or none", param_hint="--unstuck")
    new = Newcomer(
        name=name,
        files=_files_by_layout(files or [], layout or []),
        encoding=encoding,
        sampling=sampling.value,
        unstuck_after_ticks=None if unstuck == "none" else int(unstuck),
        command=shlex.join(["galley", *sys.argv[1:]]),
    )

    def convert(path: Path, shape: tuple[int, ...]) -> Converted:
        told = (
            f"{path}: it was not made into ONNX within {CONVERT_S} s; it does not end, or export it yourself"
        )
        with ends_within(CONVERT_S, told):
            return _converted(path, shape, from_, network)

    try:
        added = add_network(Workspace(workspace), new, convert, replace=replace, progress=ProgressLines())
    except InvalidFiles as error:
        if json_:
            typer.echo(json.dumps({"name": name, "added": False, "reasons": _reasons(error.problems)}))
        raise
    if json_:
        figures = [one.as_json() for one in added.figures]
        row = {"name": name, "added": True, "path": added.path.as_posix(), "sha256": added.sha256}
        typer.echo(json.dumps({**row, "notes": added.notes, "layouts": figures}))
        return
    for one in added.figures:
        typer.echo(
            f"{one.layout}: score {one.score} with itself, decision {one.decision_p50_ms:.2f} ms, "
            f"99th percentile {one.decision_p99_ms:.2f} ms"
        )
        for note in added.notes[one.layout]:
            typer.echo(f"  {note}")
    typer.echo(f"Added {name} in {added.path.as_posix()}; write what it is into its card.md.")


def _files_by_layout(files: Sequence[Path], layouts: Sequence[str]) -> dict[str, Path]:
    """The file for each layout: its own, the only FILE, or the FILE that is called like the layout."""
    by_stem = {path.stem: path for path in files}
    if len(by_stem) < len(files):
        raise typer.BadParameter("two files have one name; use --layout L=FILE", param_hint="FILE")
    found: dict[str, Path] = {}
    for one in layouts or by_stem:
        layout, equals, own = one.partition("=")
        path = Path(own) if equals else files[0] if len(files) == 1 else by_stem.get(layout)
        if path is None:
            raise typer.BadParameter(f"no FILE is called {layout}; use {layout}=FILE", param_hint="--layout")
        if layout in found:
            raise typer.BadParameter(f"{layout} is named twice", param_hint="--layout")
        found[layout] = path
    unused = [path.as_posix() for path in files if path not in found.values()]
    if unused or not found:
        told = f"no layout takes {', '.join(unused)}" if unused else "name at least one"
        raise typer.BadParameter(told, param_hint="FILE")
    return found


def _converted(path: Path, shape: tuple[int, ...], origin: Origin, network: str | None) -> Converted:
    """The network of a file as ONNX; what changes files is imported only if one must be changed."""
    if origin is Origin.onnx:
        from galley.agents.admission.adding import as_it_is
        from galley.agents.network import DecisionGivenUp

        meant = _other_kind(path)
        if meant is not None:
            raise GalleyError(f"this is no ONNX file but {meant}")
        try:
            return as_it_is(path, shape)
        except DecisionGivenUp:
            raise
        except GalleyError as error:
            _need(["onnx"], f"{error}; what can be mended is mended with the package onnx")
        from galley.learning.bundles.onnx_adapting import conform

        return conform(path, shape)
    _need(["torch", "onnx"], f"adding from {origin.value} needs PyTorch")
    from galley.learning.bundles.torch_files import from_state_dict, from_torchscript

    if network is None:
        return from_torchscript(path, shape)
    return from_state_dict(path, network, shape)


def _other_kind(path: Path) -> str | None:
    """What a file that PyTorch or others wrote is, with how to name it; None if it may be ONNX."""
    with path.open("rb") as file:
        start = file.read(4)
    if start == b"PK\x03\x04":
        try:
            with zipfile.ZipFile(path) as archive:
                parts = archive.namelist()
        except zipfile.BadZipFile:
            return "a damaged zip file; save it again"
        if any(part.endswith("constants.pkl") for part in parts):
            return "TorchScript; name `--from torchscript`"
        if any(part.endswith("data.pkl") for part in parts):
            return "a file of torch.save; name `--from state-dict --network ...`"
        if any(part.endswith((".pth", ".pt")) for part in parts):
            return (
                "a zip with PyTorch files (as stable-baselines3 saves); take the .pth out of it and add that"
            )
        return "a zip file; add the network that is in it"
    if start[:1] == b"\x80":
        return "a pickle (torch.save in its old form?); name `--from state-dict --network ...`"
    if start == b"\x89HDF":
        return "an HDF5 file (Keras?); export it to ONNX and add that"
    return None


def _need(packages: Sequence[str], why: str) -> None:
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    if missing:
        raise GalleyError(f"{why}; {', '.join(missing)} not installed: pip install 'galley[learn]'")


def _reasons(problems: Sequence[Problem]) -> list[dict[str, str]]:
    return [{"file": one.path, "reason": one.message, "fix": one.fix} for one in problems]
