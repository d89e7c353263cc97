"""The agents of a workspace, by name."""

from __future__ import annotations

from galley.agents.bundle import Bundle, load_bundle
from galley.agents.trial import trial
from galley.errors import InvalidFiles, Problem
from galley.kitchen.layout_file import load_layouts
from galley.names import name_fix
from galley.workspace import Workspace


class Catalogue:
    """All agent bundles of a workspace; each is read when first asked for."""

    def __init__(self, workspace: Workspace) -> None:
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
            self._bundles[name] = load_bundle(folder, self._workspace.shown(folder))
        return self._bundles[name]

    def check(self) -> list[Problem]:
        """All problems of all bundles: their files, and how they play on every layout that they name.

        Wrong layout files are told too, since agents cannot be tried on them.
        """
        problems: list[Problem] = []
        try:
            layouts = load_layouts(self._workspace)
        except InvalidFiles as error:
            return list(error.problems)
        distinct = {layout.name: layout for layout in layouts.values()}
        for name in self.names():
            try:
                bundle = self.bundle(name)
            except InvalidFiles as error:
                problems += error.problems
                continue
            for layout_name in distinct if bundle.layouts is None else bundle.layouts:
                if layout_name in distinct:
                    problems += trial(bundle, distinct[layout_name]).problems
                else:
                    told = f"layout '{layout_name}' is not in the workspace"
                    place = ("layouts", layout_name)
                    problems.append(bundle.loaded.problem(place, told, name_fix(layout_name, distinct)))
        return problems
