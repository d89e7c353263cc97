"""Layouts from their files, `layouts/<name>.yaml`: all that the kitchen reads of what people wrote."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from pydantic import Field

from galley.errors import GalleyError, InvalidFiles, Problem
from galley.files.reading import FileModel, Loaded, load
from galley.kitchen.codes import STATIONS
from galley.kitchen.layout import Layout, Rules, grid_problems
from galley.kitchen.reach import reachable_stations
from galley.names import name_fix
from galley.workspace import NAME, Workspace


class RulesFile(FileModel):
    """The rules of a layout file; what is left out is as in the COLE paper."""

    rule_set: str = "classic"
    cook_time_ticks: int = 20
    delivery_reward: int = 20
    horizon_ticks: int = 400
    orders: tuple[str, ...] | None = None


class LayoutFile(FileModel):
    """A layout file; the layout's name is the file's."""

    format: Literal[1]
    title: str = Field(min_length=1)
    source: str = Field(min_length=1)
    aliases: tuple[str, ...] = ()
    rules: RulesFile = RulesFile()
    grid: str


def load_layout(path: Path, shown: str | None = None) -> Layout:
    """The layout in the file at `path`; messages call the file `shown`.

    Raises:
        InvalidFiles: all that is wrong with it, each with line and fix.
    """
    return _read(path, shown)[1]


def load_layouts(workspace: Workspace) -> dict[str, Layout]:
    """All layouts of a workspace by name and by alias.

    Raises:
        InvalidFiles: all that is wrong with any of them, or a name or alias taken twice.
    """
    problems: list[Problem] = []
    read: dict[str, tuple[Loaded[LayoutFile], Layout]] = {}
    for name in workspace.names("layouts"):
        path = workspace.find("layouts", name)
        try:
            read[name] = _read(path, workspace.shown(path))
        except InvalidFiles as error:
            problems += error.problems
    found = {name: layout for name, (_, layout) in read.items()}
    for file, layout in read.values():
        for number, alias in enumerate(layout.aliases):
            taken = found.setdefault(alias, layout)
            if taken is not layout:
                told = f"alias '{alias}' already belongs to layout {taken.name}"
                problems.append(file.problem(("aliases", number), told, "use another alias"))
    if problems:
        raise InvalidFiles(problems)
    return found


def find_layout(workspace: Workspace, name: str) -> Layout:
    """The layout of that name or alias.

    Raises:
        InvalidFiles: the layout's file, or while looking for an alias any layout file, is wrong.
        GalleyError: there is no such layout; the message names the nearest.
    """
    if NAME.fullmatch(name) and name in workspace.names("layouts"):
        path = workspace.find("layouts", name)
        return load_layout(path, workspace.shown(path))
    layouts = load_layouts(workspace)
    if name not in layouts:
        place = workspace.shown(workspace.folder("layouts"))
        raise GalleyError(f"{place}: no layout is named '{name}'; {name_fix(name, tuple(layouts))}")
    return layouts[name]


def _read(path: Path, shown: str | None) -> tuple[Loaded[LayoutFile], Layout]:
    file = load(path, LayoutFile, shown)
    grid = tuple(file.value.grid.rstrip("\n").split("\n"))
    asked = file.value.rules
    rules = Rules(
        asked.rule_set, asked.cook_time_ticks, asked.delivery_reward, asked.horizon_ticks, asked.orders
    )
    problems = [
        file.problem(("rules", key), *_message_and_fix(text)) for key, text in rules.problems().items()
    ]
    for number, alias in enumerate(file.value.aliases):
        if not alias.strip():
            problems.append(
                file.problem(("aliases", number), "an alias is empty", "write a name or remove it")
            )
    problems += [
        Problem(file.path, _row_line(file, found.row), found.message, found.fix)
        for found in grid_problems(grid)
    ]
    if not problems:
        layout = Layout(path.stem, grid, rules, file.value.title, file.value.aliases, file.value.source)
        problems = _station_problems(file, layout)
    if problems:
        raise InvalidFiles(problems)
    return file, layout


def _message_and_fix(text: str) -> tuple[str, str]:
    message, fix = text.split("; ", 1)
    return message, fix


def _row_line(file: Loaded[LayoutFile], row: int | None) -> int:
    return file.line("grid") if row is None else file.text_line("grid", row=row)


def layout_remarks(path: Path, shown: str) -> list[Problem]:
    """What is no mistake in a layout's file: stations out of reach whose kind can be reached elsewhere.

    Raises:
        InvalidFiles: all that is a mistake.
    """
    file, layout = _read(path, shown)
    return [problem for problem, spare in _out_of_reach(file, layout) if spare]


def _out_of_reach(file: Loaded[LayoutFile], layout: Layout) -> Iterator[tuple[Problem, bool]]:
    """Each station that no chef can reach, and whether others of its kind can be reached."""
    reached = frozenset().union(*reachable_stations(layout))
    for tile, name in STATIONS.items():
        places = layout.places(tile)
        spare = any(place in reached for place in places)
        for x, y in places:
            if (x, y) not in reached:
                told = f"the {name} at column {x + 1} cannot be reached by any chef"
                fix = "open floor beside it or remove it"
                yield Problem(file.path, _row_line(file, y), told, fix), spare


def _station_problems(file: Loaded[LayoutFile], layout: Layout) -> list[Problem]:
    """Stations that no chef can reach, and kinds of station without which no soup can be served."""
    problems = [problem for problem, spare in _out_of_reach(file, layout) if not spare]
    ingredients = [*layout.onions, *layout.tomatoes]
    wanted = set(layout.rules.orders or ())
    missing = [
        (not layout.pots, "pot", "P"),
        (not ingredients, "ingredient dispenser", "O or T"),
        (
            "onion" in wanted and not layout.onions and bool(ingredients),
            "onion dispenser for the orders",
            "O",
        ),
        (
            "tomato" in wanted and not layout.tomatoes and bool(ingredients),
            "tomato dispenser for the orders",
            "T",
        ),
        (not layout.dishes, "dish dispenser", "D"),
        (not layout.servings, "serving place", "S"),
    ]
    for absent, name, letter in missing:
        if absent:
            problems.append(file.problem(("grid",), f"there is no {name}", f"draw at least one {letter}"))
    return problems
