"""Everything that is wrong with a workspace's files."""

from __future__ import annotations

from collections.abc import Iterator

from galley.errors import InvalidFiles, Problem
from galley.study.describe import describe
from galley.study.study import known_layouts_of, load_study
from galley.study.written.named_files import catalogue_problems
from galley.study.written.pictures import SUFFIXES
from galley.study.written.questionnaire import load_questionnaire
from galley.study.written.recruitment import load_invitations
from galley.study.written.texts import load_text
from galley.workspace import KINDS, NAME, Workspace

__all__ = ["check_study", "check_workspace", "describe"]


def check_study(workspace: Workspace, name: str) -> list[Problem]:
    """All problems of one study and of what it names, each once and in order.

    Raises:
        GalleyError: the workspace has no such study.
    """
    try:
        load_study(workspace, name)
    except InvalidFiles as invalid:
        return list(invalid.problems)
    return []


def check_workspace(workspace: Workspace) -> list[Problem]:
    """All problems of a workspace's files, agents aside, named or not: each once and in order."""
    problems = [*_misplaced(workspace), *catalogue_problems(workspace)]
    layouts, _ = known_layouts_of(workspace, problems)
    grids = {name: layout.grid for name, layout in layouts.items()} or None
    for name in workspace.names("questionnaires"):
        path = workspace.find("questionnaires", name)
        try:
            load_questionnaire(path, workspace.shown(path))
        except InvalidFiles as invalid:
            problems += invalid.problems
    for name in workspace.names("texts"):
        path = workspace.find("texts", name)
        try:
            load_text(path, workspace.shown(path), grids)
        except InvalidFiles as invalid:
            problems += invalid.problems
    for name in workspace.names("invitations"):
        path = workspace.find("invitations", name)
        try:
            load_invitations(path, workspace.shown(path))
        except InvalidFiles as invalid:
            problems += invalid.problems
    for name in workspace.names("studies"):
        try:
            load_study(workspace, name)
        except InvalidFiles as invalid:
            problems += invalid.problems
    if not workspace.names("studies"):
        shown = workspace.shown(workspace.folder("studies"))
        problems.append(Problem(shown, None, "there is no study", "write one, see docs/first-study.md"))
    return list(InvalidFiles(problems).problems)


def _misplaced(workspace: Workspace) -> Iterator[Problem]:
    """Files that lie in a workspace's folders and would silently be left out."""
    for kind in KINDS:
        folder = workspace.folder(kind)
        if kind == "agents" or not folder.is_dir():
            continue
        suffix = workspace.suffix(kind)
        for path in sorted(folder.iterdir()):
            if kind == "catalogues" and path.is_dir() and any(path.rglob("*.po")):
                shown = workspace.shown(path)
                fix = f"move it to {workspace.shown(folder)}/{path.name}.po"
                yield Problem(shown, None, "catalogues in folders of their own are not read", fix)
            if path.is_dir() or path.name.startswith("."):
                continue
            shown = workspace.shown(path)
            if kind == "texts" and path.suffix.lower() in SUFFIXES:
                continue
            if path.suffix != suffix:
                fix = f"rename it to {path.stem}{suffix}, or move it elsewhere"
                yield Problem(shown, None, f"only {suffix} files are read here", fix)
            elif not NAME.fullmatch(path.stem):
                fix = "use letters, digits, - and _, and start with a letter or digit"
                yield Problem(shown, None, f"'{path.stem}' is no name", fix)
