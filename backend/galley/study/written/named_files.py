"""The files that a study names: layouts that can be used, texts in a language, the hash of them all."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from galley.errors import InvalidFiles, Problem
from galley.kitchen import Layout
from galley.kitchen.layout_file import load_layout, load_layouts
from galley.study.written.pictures import picture_files
from galley.study.written.study_file import StudyFile, names_of
from galley.translations import Catalogues
from galley.workspace import Workspace


def known_layouts_of(
    workspace: Workspace, problems: list[Problem]
) -> tuple[Mapping[str, Layout], tuple[str, ...]]:
    """(layouts by name and alias, names that may be used); what is wrong with layouts joins `problems`."""
    try:
        layouts = load_layouts(workspace)
    except InvalidFiles as invalid:
        problems += invalid.problems
        layouts = dict(_good_layouts(workspace))
    return layouts, tuple({*layouts, *workspace.names("layouts")})


def _good_layouts(workspace: Workspace) -> Iterator[tuple[str, Layout]]:
    for name in workspace.names("layouts"):
        with suppress(InvalidFiles):
            layout = load_layout(workspace.find("layouts", name))
            yield from ((called, layout) for called in (*layout.aliases, name))


def catalogue_problems(workspace: Workspace) -> list[Problem]:
    """What is wrong with the workspace's own catalogues."""
    folder = workspace.folder("catalogues")
    try:
        if folder.is_dir():
            Catalogues.load(folder)
    except InvalidFiles as invalid:
        return list(invalid.problems)
    return []


def text_file(workspace: Workspace, name: str, language: str, *, own: bool) -> Path | None:
    """`texts/NAME.LANGUAGE.md`, or in the study's `own` language `texts/NAME.md` if there is no such file."""
    known = workspace.names("texts")
    if f"{name}.{language}" in known:
        return workspace.find("texts", f"{name}.{language}")
    return workspace.find("texts", name) if own and name in known else None


def content_sha256(workspace: Workspace, name: str, config: StudyFile, layouts: Iterable[Layout]) -> str:
    """The hash over the study's file, all it names and its languages' catalogues: names and contents."""
    texts = (
        text_file(workspace, text, language, own=language == config.languages[0])
        for text in names_of(config, "texts")
        for language in config.languages
    )
    spoken = {code.partition("-")[0] for code in config.languages}
    catalogues = workspace.folder("catalogues").glob("*.po")
    known = {text for text in texts if text is not None}
    files = {
        *(file for file in catalogues if re.split("[-_]", file.stem)[0] in spoken),
        workspace.find("studies", name),
        *(workspace.find("questionnaires", name) for name in names_of(config, "questionnaires")),
        *known,
        *(picture for text in known for picture in picture_files(text)),
        *(workspace.find("layouts", layout.name) for layout in layouts),
    }
    total = hashlib.sha256()
    for file in sorted(files):
        content = file.read_bytes()
        total.update(f"{workspace.shown(file)}\0{len(content)}\0".encode())
        total.update(content)
    return total.hexdigest()
