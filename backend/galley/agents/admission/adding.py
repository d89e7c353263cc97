"""Agents brought in from elsewhere: made into bundles, if they pass the gate."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from galley.agents.admission.card import card
from galley.agents.admission.gate import Figures, gate, probabilities
from galley.agents.bundle import describe_network, load_bundle
from galley.agents.network import DECISION_S, DecisionGivenUp, Network, Sampling
from galley.errors import GalleyError, InvalidFiles, Problem
from galley.files.whole import whole_folder
from galley.kitchen import ENCODINGS, Encoder, Layout
from galley.kitchen.layout_file import find_layout
from galley.names import name_fix
from galley.progress_lines import Progress, untold
from galley.workspace import NAME, Workspace

MEND = "mend it and add it again, see docs/add-an-agent.md"


@dataclass(frozen=True)
class Converted:
    """A policy as ONNX, and what had to be changed for it, in words."""

    content: bytes
    notes: tuple[str, ...] = ()


Convert = Callable[[Path, tuple[int, ...]], Converted]
"""From a file and the shape of one seat's observation to ONNX.

Raises:
    GalleyError: why it cannot be.
"""


@dataclass(frozen=True)
class Newcomer:
    """An agent that asks to be let in; `files` holds the file for each layout name."""

    name: str
    files: Mapping[str, Path]
    encoding: str
    sampling: Sampling = "sample"
    unstuck_after_ticks: int | None = None
    command: str = ""


@dataclass(frozen=True)
class Added:
    """A bundle that was let in."""

    name: str
    path: Path
    sha256: str
    figures: tuple[Figures, ...]
    notes: Mapping[str, tuple[str, ...]]


@dataclass
class _Work:
    """What is known of a newcomer so far."""

    layouts: dict[str, Layout] = field(default_factory=dict)
    converted: dict[str, Converted] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)


def add_network(
    workspace: Workspace,
    new: Newcomer,
    convert: Convert,
    *,
    replace: bool = False,
    progress: Progress = untold,
) -> Added:
    """The bundle made of a network's files, in `agents/` of the workspace with its card.

    Raises:
        InvalidFiles: every reason why it is not let in; `agents/` is as it was.
    """
    work = _Work()
    agents = workspace.folder("agents")
    place = agents / new.name
    named = NAME.fullmatch(new.name) is not None
    if not named:
        told = f"'{new.name}' is no name for an agent"
        work.problems.append(Problem("--name", None, told, "use letters, digits, _ . and -"))
    elif place.exists() and not replace:
        told = "there is an agent of this name"
        work.problems.append(
            Problem(workspace.shown(place), None, told, "choose another, or overwrite it with --replace")
        )
    if new.encoding not in ENCODINGS:
        told = f"encoding '{new.encoding}' is unknown"
        work.problems.append(Problem("--encoding", None, told, name_fix(new.encoding, ENCODINGS)))
    _convert_all(workspace, new, convert, work)
    with whole_folder(place if named else agents / "agent", replace=replace) as folder:
        figures = _tried(folder, new, work, progress)
        if work.problems:
            raise InvalidFiles(work.problems)
        (folder / "card.md").write_text(_card_text(new, work, figures), "utf-8")
        sha256 = load_bundle(folder, workspace.shown(place)).sha256
    notes = {name: found.notes for name, found in work.converted.items()}
    return Added(new.name, place, sha256, tuple(figures), notes)


def as_it_is(path: Path, shape: tuple[int, ...]) -> Converted:
    """An ONNX file that needs no change.

    Raises:
        GalleyError: why it does.
    """
    network = Network(path, shape, DECISION_S)
    seen = np.random.default_rng(0).integers(0, 3, (4, *shape)).astype(np.float32)
    memory = network.start()
    states = None if memory is None else np.repeat(memory[None], len(seen), axis=0)
    try:
        rows, _ = network.run(seen, states)
    except DecisionGivenUp:
        raise
    except GalleyError:  # the gate tells it, with all else
        return Converted(path.read_bytes())
    if probabilities(rows):
        raise GalleyError("the outputs are probabilities, not logits")
    return Converted(path.read_bytes())


def _convert_all(workspace: Workspace, new: Newcomer, convert: Convert, work: _Work) -> None:
    for layout_name, path in new.files.items():
        if not path.is_file():
            work.problems.append(Problem(path.as_posix(), None, "no such file", "name the network's file"))
        try:
            layout = find_layout(workspace, layout_name)
        except InvalidFiles as error:
            work.problems += error.problems
            continue
        except GalleyError as error:
            message, _, fix = str(error).removeprefix("layouts: ").partition("; ")
            work.problems.append(Problem("--layout", None, message, fix))
            continue
        if new.encoding not in ENCODINGS or not path.is_file():
            continue
        try:
            converted = convert(path, tuple(Encoder(layout, new.encoding).shape))
        except GalleyError as error:
            told = f"for layout '{layout.name}': {error}"
            work.problems.append(Problem(path.as_posix(), None, told, MEND))
            continue
        work.layouts[layout.name] = layout
        work.converted[layout.name] = converted


def _tried(folder: Path, new: Newcomer, work: _Work, progress: Progress) -> list[Figures]:
    """The figures of all layouts that could be converted; the reasons to reject go to the problems."""
    if not work.converted:
        return []
    for name, converted in work.converted.items():
        (folder / f"{name}.onnx").write_bytes(converted.content)
    describe_network(
        folder,
        work.converted,
        encoding=new.encoding,
        sampling=new.sampling,
        unstuck_after_ticks=new.unstuck_after_ticks,
    )
    bundle = load_bundle(folder, f"agents/{folder.name}", DECISION_S)
    figures = []
    sources = dict(_by_layout(new.files, work))
    for name, layout in work.layouts.items():
        measured, faults = gate(bundle, layout, progress)
        figures.append(measured)
        shown = sources[name].as_posix()
        work.problems += [Problem(shown, None, f"on layout '{name}' {fault}", MEND) for fault in faults]
    return figures


def _by_layout(files: Mapping[str, Path], work: _Work) -> Iterator[tuple[str, Path]]:
    """The file of each layout by its own name, whatever alias it was asked for by."""
    for asked, path in files.items():
        for name, layout in work.layouts.items():
            if asked == name or asked in layout.aliases:
                yield name, path


def _card_text(new: Newcomer, work: _Work, figures: Sequence[Figures]) -> str:
    files = dict(_by_layout(new.files, work))
    hashes = {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files.values()}
    return card(
        new.name,
        sources={name: (path.name, hashes[path]) for name, path in files.items()},
        notes={name: found.notes for name, found in work.converted.items()},
        command=new.command,
        encoding=new.encoding,
        sampling=new.sampling,
        unstuck_after_ticks=new.unstuck_after_ticks,
        figures=figures,
    )
