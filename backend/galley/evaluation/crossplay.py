"""Bundles played with each other in both seats, on one process or many."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from galley.agents.bundle import Bundle, load_bundle
from galley.agents.catalogue import Catalogue
from galley.agents.episode import play_episodes
from galley.errors import GalleyError
from galley.evaluation.agent_groups import AgentGroup
from galley.evaluation.game_scores import Cell, GameScores, Key
from galley.kitchen import Layout
from galley.kitchen.layout_file import find_layout
from galley.workers import map_tasks
from galley.workspace import Workspace


class Roster:
    """The bundles of an evaluation by name: agents of a workspace, or folders (written with a `/`)."""

    def __init__(self, workspace: Path) -> None:
        self._catalogue = Catalogue(Workspace(workspace))
        self._bundles: dict[str, Bundle] = {}

    def bundle(self, name: str) -> Bundle:
        """The bundle that a name or folder names.

        Raises:
            GalleyError: there is none.
            InvalidFiles: all that is wrong with its files.
        """
        if name not in self._bundles:
            if "/" in name:
                folder = Path(name)
                if not folder.is_dir():
                    raise GalleyError(f"{name}: no such folder; name an agent or the folder of a bundle")
                self._bundles[name] = load_bundle(folder, folder.as_posix())
            else:
                self._bundles[name] = self._catalogue.bundle(name)
        return self._bundles[name]


@dataclass(frozen=True)
class Task:
    """One cell to play: the layout and who sits where, as text that can travel to another process."""

    layout: str
    seats: tuple[str, str]
    fingerprint: str


def pairings(
    agents: Sequence[AgentGroup], partners: Sequence[AgentGroup] | None, itself: bool
) -> list[tuple[str, str]]:
    """Who sits on seat 0 and seat 1 of each cell, each once.

    Without `partners` every agent plays every other and itself; with them it plays these in both seats, and
    itself too if `itself`.
    """
    found: dict[tuple[str, str], None] = {}
    for one in agents:
        if itself or partners is None:
            found |= dict.fromkeys((name, name) for name in one.members)
        for other in agents if partners is None else partners:
            if other.members == one.members:
                found |= dict.fromkeys((name, name) for name in one.members)
                continue
            for name in one.members:
                for partner in other.members:
                    found[name, partner] = found[partner, name] = None
    return list(found)


def find_layouts(
    workspace: Path, roster: Roster, names: Sequence[str], wanted: Sequence[str]
) -> list[Layout]:
    """The layouts to play on: those wanted, or all that every agent (`names`) knows.

    Raises:
        GalleyError: an agent does not know a layout; none is wanted and all agents know any, or none in
        common.
    """
    home = Workspace(workspace)
    known: set[str] | None = None
    ordered: list[str] = []
    for name in names:
        layouts = roster.bundle(name).layouts
        if layouts is not None:
            ordered = ordered or list(layouts)
            known = set(layouts) if known is None else known & set(layouts)
    chosen = list(wanted) or [name for name in ordered if known and name in known]
    if not chosen:
        raise GalleyError("no layout is known to all these agents; name one with --layout")
    found = [find_layout(home, name) for name in dict.fromkeys(chosen)]
    strangers = [
        f"agent {name} does not know layout '{layout.name}'; leave one of them out"
        for layout in found
        for name in names
        if not roster.bundle(name).supports(layout.name)
    ]
    if strangers:
        raise GalleyError("\n".join(strangers))
    return found


def play_cells(
    results: GameScores,
    layouts: Sequence[Layout],
    pairs: Sequence[tuple[str, str]],
    *,
    workspace: Path,
    games: int,
    seed: int,
    workers: int = 1,
    scheduler: str | None = None,
    on_start: Callable[[int], None] = lambda cells: None,
    on_done: Callable[[Cell], None] = lambda cell: None,
) -> None:
    """Add to `results` every cell that is not there yet with as many games of the same agents.

    The seeds of a cell's games follow from `seed` and the three names alone, so a cell is the same wherever,
    beside whatever others and in whatever order it is played. `on_start` is told how many cells are to be
    played, `on_done` each as soon as it is there.

    Raises:
        GalleyError: an agent cannot be loaded or played; the results hold games of another seed; the
            scheduler does not answer.
    """
    others = sorted({cell.seed for cell in results} - {seed})
    if others:
        raise GalleyError(
            f"the results hold games of seed {others[0]}, which those of seed {seed} would replace; "
            f"use --seed {others[0]}, or another file"
        )
    roster = Roster(workspace)
    tasks = []
    for layout in layouts:
        for pair in pairs:
            bundles = [roster.bundle(name) for name in pair]
            fingerprint = _fingerprint(layout, bundles)
            kept = results.get(layout.name, *pair)
            if kept is None or kept.fingerprint != fingerprint or len(kept.scores) < games:
                tasks.append(Task(layout.name, pair, fingerprint))
    on_start(len(tasks))

    def keep(place: int, cell: Cell) -> None:
        results.add(cell)
        on_done(cell)

    do = functools.partial(_play, workspace=str(workspace.resolve()), games=games, seed=seed)
    map_tasks(do, tasks, workers, scheduler, keep)


def game_seeds(seed: int, key: Key, games: int) -> list[int]:
    """The seeds of the games of a cell; more games begin with the same ones."""
    named = hashlib.sha256("\0".join(key).encode()).digest()
    source = np.random.SeedSequence((seed, int.from_bytes(named[:8], "big")))
    seeds: list[int] = source.generate_state(games, np.uint64).tolist()
    return seeds


def _play(task: Task, workspace: str, games: int, seed: int) -> Cell:
    roster = Roster(Path(workspace))
    layout = find_layout(Workspace(workspace), task.layout)
    seats = (roster.bundle(task.seats[0]), roster.bundle(task.seats[1]))
    if _fingerprint(layout, seats) != task.fingerprint:
        raise GalleyError(
            f"{' and '.join(task.seats)} on {task.layout} are not the same here as where the evaluation "
            "began; give every worker the same workspace"
        )
    key = (layout.name, seats[0].name, seats[1].name)
    scores = play_episodes(layout, seats, game_seeds(seed, key, games))
    return Cell(
        layout=layout.name,
        seat_0=task.seats[0],
        seat_1=task.seats[1],
        seed=seed,
        fingerprint=task.fingerprint,
        scores=tuple(scores.tolist()),
    )


def _fingerprint(layout: Layout, bundles: Sequence[Bundle]) -> str:
    """A hash of all that decides what is played but the seed: not of cards, which tell the results."""
    told_elsewhere = ("title", "aliases", "source")
    kitchen = {key: value for key, value in layout.to_dict().items() if key not in told_elsewhere}
    told = json.dumps([kitchen, *(_acting(bundle, layout) for bundle in bundles)], sort_keys=True)
    return hashlib.sha256(told.encode()).hexdigest()


def _acting(bundle: Bundle, layout: Layout) -> dict[str, Any]:
    """What decides how a bundle acts on a layout."""
    acting = bundle.loaded.value.model_dump(exclude={"name", "layouts", "format"})
    if bundle.layouts is not None:
        content = (bundle.path / bundle.layouts[layout.name]).read_bytes()
        acting["network"] = hashlib.sha256(content).hexdigest()
    return acting
