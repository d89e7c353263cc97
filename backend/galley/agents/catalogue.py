"""The agents of a workspace, by name."""

from __future__ import annotations

from collections.abc import Mapping

from galley.agents.bundle import Bundle, load_bundle
from galley.agents.conformance import check
from galley.errors import InvalidFiles, Problem
from galley.kitchen import Layout
from galley.kitchen.layout_file import load_layout
from galley.names import name_fix
from galley.progress_lines import Progress, untold
from galley.workspace import Workspace


class Catalogue:
    """All agent bundles of a workspace; each is read when first asked for.

    With `limit_s` a decision of a network that takes longer is given up.
    """

    def __init__(self, workspace: Workspace, limit_s: float | None = None) -> None:
        self._limit_s = limit_s
        self._workspace = workspace
        self._bundles: dict[str, Bundle] = {}

    def names(self) -> tuple[str, ...]:
        """The names of all bundles, sorted."""
        return self._workspace.names("agents")

    def bundle(self, name: str) -> Bundle:
        """The bundle of this name.

        Raises:
            GalleyError: there is no such agent.
            InvalidFiles: everything that is wrong with its files.
        """
        if name not in self._bundles:
            folder = self._workspace.find("agents", name)
            self._bundles[name] = load_bundle(folder, self._workspace.shown(folder), self._limit_s)
        return self._bundles[name]

    def check(self, progress: Progress = untold) -> list[Problem]:
        """All problems of all bundles: their files, and how they play on every layout that they name.

        Those that name none are tried on the smallest and the largest of the workspace. Wrong layout files
        are told too, since no agent can be tried on them.
        """
        layouts, problems = self._layouts()
        for name in self.names():
            try:
                bundle = self.bundle(name)
            except InvalidFiles as error:
                problems += error.problems
                continue
            for layout_name in _extremes(layouts) if bundle.layouts is None else bundle.layouts:
                if layout_name not in layouts:
                    told = f"layout '{layout_name}' is not in the workspace"
                    place = ("layouts", layout_name)
                    problems.append(bundle.loaded.problem(place, told, name_fix(layout_name, layouts)))
                    continue
                layout = layouts[layout_name]
                if layout is not None:
                    problems += problems_on(bundle, layout, progress)
        return problems

    def _layouts(self) -> tuple[dict[str, Layout | None], list[Problem]]:
        """The layouts of the workspace by name, None for those whose files are wrong, and what is wrong."""
        layouts: dict[str, Layout | None] = {}
        problems: list[Problem] = []
        for name in self._workspace.names("layouts"):
            path = self._workspace.find("layouts", name)
            try:
                layouts[name] = load_layout(path, self._workspace.shown(path))
            except InvalidFiles as error:
                layouts[name] = None
                problems += error.problems
        return layouts, problems


def problems_on(bundle: Bundle, layout: Layout, progress: Progress = untold) -> tuple[Problem, ...]:
    """Every promise that a bundle's agents break on a layout, at its line in agent.yaml."""
    try:
        faults = check(bundle.make, layout, think_ms=bundle.think_ms, progress=_of(bundle, progress)).faults
    except InvalidFiles as error:
        return error.problems
    place = ("layouts",) if bundle.layouts is None else ("layouts", layout.name)
    return tuple(
        bundle.loaded.problem(
            place,
            f"on layout '{layout.name}' {fault.what}",
            f"{fault.fix}, or replace the agent, see docs/add-an-agent.md",
        )
        for fault in faults
    )


def _of(bundle: Bundle, progress: Progress) -> Progress:
    return lambda what, done, of: progress(f"{bundle.name} {what}", done, of)


def _extremes(layouts: Mapping[str, Layout | None]) -> list[str]:
    """The names of the layouts with the fewest and the most tiles."""
    sizes = {name: layout.tiles.size for name, layout in layouts.items() if layout is not None}
    by_size = sorted(sizes, key=lambda name: sizes[name])
    return list(dict.fromkeys([*by_size[:1], *by_size[-1:]]))
