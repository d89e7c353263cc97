"""What is no mistake in a workspace's files, but worth a look before people come."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from galley.errors import Problem
from galley.files.reading import Loc, read
from galley.kitchen.layout_file import layout_remarks
from galley.study.language_remarks import language_remarks
from galley.study.study import Study
from galley.study.written.study_file import StudyFile
from galley.workspace import Workspace

PROXY_FORM_BYTES: Final = 1024 * 1024
"""What nginx passes on of a form unless it is told otherwise (client_max_body_size)."""
READ_AS_MISSING = frozenset(
    ("null", "nan", "na", "n/a", "<na>", "#n/a", "#na", "none", "nil", "-nan", "1.#ind", "1.#qnan", "")
)
"""What pandas and R take for a missing value in a CSV file, in lower case."""


def study_remarks(workspace: Workspace, study: Study) -> Iterator[Problem]:
    """Remarks on a study and on what it names."""
    path = workspace.find("studies", study.name)
    shown = workspace.shown(path)
    document = read(path, shown)
    loaded = document.validated(StudyFile, {})
    for name, factor in study.config.factors.items():
        for place, level in enumerate(factor.levels):
            if level.casefold() in READ_AS_MISSING:
                yield _missing(Problem(shown, loaded.line("factors", name, "levels", place), "", ""), level)
    yield from language_remarks(workspace, study, document)
    for name, questionnaire in study.questionnaires.items():
        file = workspace.find("questionnaires", name)
        lines = read(file, workspace.shown(file)).lines
        most = questionnaire.form_size[0]
        if most > PROXY_FORM_BYTES:
            told = (
                f"the longest answers take {most / PROXY_FORM_BYTES:.1f} MiB, and many proxies pass on 1 MiB"
            )
            fix = "lower max_length, ask on two pages, or see the limits in docs/scaling-out.md"
            yield Problem(workspace.shown(file), lines.get(("items",), 1), told, fix)
        for place, item in enumerate(questionnaire.items):
            for n, option in enumerate(item.choosable):
                loc: Loc = ("items", place, "options", n, "value")
                if option.casefold() in READ_AS_MISSING:
                    line = lines.get(loc, lines.get(loc[:-1], 1))
                    yield _missing(Problem(workspace.shown(file), line, "", ""), option)
    for layout in {layout.name: layout for layout in study.layouts.values()}.values():
        file = workspace.find("layouts", layout.name)
        yield from layout_remarks(file, workspace.shown(file))


def _missing(place: Problem, value: str) -> Problem:
    told = f"'{value}' is what pandas and R read as a missing value"
    fix = 'use another word, or read exports with keep_default_na=False (R: na.strings = "")'
    return Problem(place.path, place.line, told, fix)
