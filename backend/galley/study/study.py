"""A study ready to run: its file and every file it names, read and checked against each other."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from galley.agents.bundle import Bundle, load_bundle
from galley.errors import InvalidFiles, Problem
from galley.files import Loaded, Loc, load
from galley.kitchen import Layout
from galley.kitchen.layout_file import load_layout, load_layouts
from galley.study.config import (
    Comparison,
    Consent,
    Debrief,
    Instructions,
    Questions,
    Rounds,
    StudyFile,
    Tutorial,
)
from galley.study.items import Comparison as ComparisonItem
from galley.study.questionnaire import Questionnaire, load_questionnaire
from galley.study.texts import PageText, load_text
from galley.workspace import Workspace

TEXT_S: Final = {"consent": 60, "instructions": 90, "debrief": 20}
ITEM_S: Final = 6
ROUND_EXTRA_S: Final = 8
"""Guesses of how long people take to read a page, answer an item, and start and leave a round."""


@dataclass(frozen=True)
class Study:
    """A validated study; `layouts` maps the names used in the file (aliases too) to layouts.

    `sha256` covers the study file and every questionnaire, text and layout file that it names; agents have
    hashes of their own.
    """

    name: str
    config: StudyFile
    questionnaires: Mapping[str, Questionnaire]
    texts: Mapping[str, PageText]
    layouts: Mapping[str, Layout]
    sha256: str

    @property
    def title(self) -> str:
        """What participants see first."""
        return self.config.title

    @property
    def about(self) -> str:
        """One line under the title."""
        return self.config.about

    @property
    def minutes(self) -> int:
        """How long a visit takes: as written, else estimated."""
        return estimated_minutes(self.config, self.questionnaires)

    @property
    def agents(self) -> tuple[str, ...]:
        """Every agent that a visit may meet, each once."""
        return tuple(dict.fromkeys(agent for agent, _, _ in _pairs(self.config)))


def load_study(workspace: Workspace, name: str) -> Study:
    """The study of this name, with all that it names.

    Raises:
        GalleyError: the workspace has no such study.
        InvalidFiles: everything that is wrong with its file and with the files that it names.
    """
    path = workspace.find("studies", name)
    problems: list[Problem] = []
    layouts, known_layouts = known_layouts_of(workspace, problems)
    context = {
        "layouts": known_layouts,
        **{kind: workspace.names(kind) for kind in ("agents", "questionnaires", "texts")},
    }
    try:
        loaded = load(path, StudyFile, workspace.shown(path), context)
    except InvalidFiles as invalid:
        raise InvalidFiles([*problems, *invalid.problems]) from None
    config = loaded.value
    problems += _agent_problems(workspace, loaded, layouts)
    questionnaires = {n: _questionnaire(workspace, n, problems) for n in _named(config, "questionnaire")}
    read = {n: questionnaire for n, questionnaire in questionnaires.items() if questionnaire is not None}
    problems += _comparison_problems(loaded, read)
    texts: dict[str, PageText] = {}
    grids = {n: layout.grid for n, layout in layouts.items()} or None
    for text in _named(config, "text"):
        file = workspace.find("texts", text)
        try:
            texts[text] = load_text(file, workspace.shown(file), grids, _values(config, read))
        except InvalidFiles as invalid:
            problems += invalid.problems
    if problems:
        raise InvalidFiles(problems)
    used = {layout: layouts[layout] for _, layout, _ in _pairs(config)}
    return Study(name, config, read, texts, used, _sha256(workspace, path, read, texts, used))


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


def estimated_minutes(config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> int:
    """Whole minutes that a visit takes: as written in the file, else a guess from stages and items."""
    if config.minutes is not None:
        return config.minutes
    seconds = 0.0
    for stage in config.stages:
        match stage:
            case Consent() | Instructions() | Debrief():
                seconds += TEXT_S[stage.kind]
            case Questions() | Comparison():
                seconds += _answer_s(questionnaires, stage.questionnaire)
            case Tutorial():
                seconds += _round_s(config, stage.horizon_ticks) + ROUND_EXTRA_S
            case Rounds():
                after = 0.0 if stage.after_each is None else _answer_s(questionnaires, stage.after_each)
                each = _round_s(config, None) + ROUND_EXTRA_S + after
                seconds += each * len(stage.agents) * len(stage.layouts)
    return max(1, math.ceil(seconds / 60))


def _answer_s(questionnaires: Mapping[str, Questionnaire], name: str) -> float:
    return ITEM_S * len(questionnaires[name].items) if name in questionnaires else 0.0


def _round_s(config: StudyFile, ticks: int | None) -> float:
    return config.countdown_s + (ticks or config.horizon_ticks) * config.tick_ms / 1000


def _values(config: StudyFile, questionnaires: Mapping[str, Questionnaire]) -> dict[str, int]:
    return {
        "minutes": estimated_minutes(config, questionnaires),
        "rounds": sum(len(s.agents) * len(s.layouts) for s in config.stages if isinstance(s, Rounds)),
        "round_s": round(config.horizon_ticks * config.tick_ms / 1000),
    }


def _named(config: StudyFile, kind: str) -> tuple[str, ...]:
    """The questionnaires or texts that the stages name, each once."""
    keys = ("questionnaire", "after_each") if kind == "questionnaire" else (kind,)
    names = (getattr(stage, key, None) for stage in config.stages for key in keys)
    return tuple(dict.fromkeys(name for name in names if name is not None))


def _pairs(config: StudyFile) -> Iterable[tuple[str, str, Loc]]:
    """(agent, layout, place of the agent in the file) of every round of a study."""
    for place, stage in enumerate(config.stages):
        if isinstance(stage, Tutorial):
            yield stage.agent, stage.layout, ("stages", place, "agent")
        elif isinstance(stage, Rounds):
            for n, agent in enumerate(stage.agents):
                for kitchen in stage.layouts:
                    yield agent, kitchen.layout, ("stages", place, "agents", n)


def _agent_problems(
    workspace: Workspace, loaded: Loaded[StudyFile], layouts: Mapping[str, Layout]
) -> list[Problem]:
    problems: list[Problem] = []
    bundles: dict[str, Bundle | None] = {}
    for agent, layout, loc in _pairs(loaded.value):
        if agent not in bundles:
            folder = workspace.find("agents", agent)
            try:
                bundles[agent] = load_bundle(folder, workspace.shown(folder))
            except InvalidFiles as invalid:
                bundles[agent] = None
                problems += invalid.problems
        bundle = bundles[agent]
        if bundle is not None and layout in layouts and not bundle.supports(layouts[layout].name):
            known = " ".join(bundle.layouts or ())
            told = f"agent '{agent}' cannot play on '{layout}'"
            problems.append(loaded.problem(loc, told, f"it plays on {known}; choose another agent or layout"))
    return problems


def _questionnaire(workspace: Workspace, name: str, problems: list[Problem]) -> Questionnaire | None:
    path = workspace.find("questionnaires", name)
    try:
        return load_questionnaire(path, workspace.shown(path)).value
    except InvalidFiles as invalid:
        problems += invalid.problems
        return None


def _comparison_problems(
    loaded: Loaded[StudyFile], questionnaires: Mapping[str, Questionnaire]
) -> Iterable[Problem]:
    for place, stage in enumerate(loaded.value.stages):
        key = "after_each" if isinstance(stage, Rounds) else "questionnaire"
        name = getattr(stage, key, None)
        if name is None or name not in questionnaires:
            continue
        compares = any(isinstance(item, ComparisonItem) for item in questionnaires[name].items)
        if compares and not isinstance(stage, Comparison):
            told = f"questionnaire '{name}' compares two partners, but a {stage.kind} stage shows none"
            yield loaded.problem(("stages", place, key), told, "use it in a comparison stage")
        if isinstance(stage, Comparison) and not compares:
            told = f"questionnaire '{name}' has no comparison item"
            yield loaded.problem(("stages", place, key), told, "use one whose items are of kind comparison")


def _sha256(
    workspace: Workspace,
    path: Path,
    questionnaires: Iterable[str],
    texts: Iterable[str],
    layouts: Mapping[str, Layout],
) -> str:
    files = [
        path,
        *(workspace.find("questionnaires", name) for name in questionnaires),
        *(workspace.find("texts", name) for name in texts),
        *(workspace.find("layouts", layout.name) for layout in layouts.values()),
    ]
    total = hashlib.sha256()
    for file in sorted(set(files)):
        content = file.read_bytes()
        total.update(f"{workspace.shown(file)}\0{len(content)}\0".encode())
        total.update(content)
    return total.hexdigest()
