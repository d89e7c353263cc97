"""Everything that is wrong with a workspace's files, and what participants of a study will see."""

from __future__ import annotations

import math
from collections.abc import Iterator

from galley.errors import InvalidFiles, Problem
from galley.study.questionnaire import load_questionnaire
from galley.study.stages import (
    Comparison,
    Consent,
    Debrief,
    Instructions,
    Questions,
    Rounds,
    Tutorial,
    stage_ids,
)
from galley.study.study import Study, known_layouts_of, load_study
from galley.study.texts import load_text
from galley.workspace import KINDS, NAME, Workspace


def check_workspace(workspace: Workspace) -> list[Problem]:
    """All problems of layouts, questionnaires, texts and studies, named or not, each once and in order."""
    problems = list(_misplaced(workspace))
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
    for name in workspace.names("studies"):
        try:
            load_study(workspace, name)
        except InvalidFiles as invalid:
            problems += invalid.problems
    if not workspace.names("studies"):
        shown = workspace.shown(workspace.folder("studies"))
        problems.append(Problem(shown, None, "there is no study", "write one, see docs/first-study.md"))
    return list(InvalidFiles(problems).problems)


def describe(study: Study) -> str:
    """What participants of a study will see, in lines of plain text: stages, minutes, what is drawn."""
    return "\n".join(_lines(study))


def _misplaced(workspace: Workspace) -> Iterator[Problem]:
    """Files that lie in a workspace's folders and would silently be left out."""
    for kind in KINDS:
        folder = workspace.folder(kind)
        if kind == "agents" or not folder.is_dir():
            continue
        suffix = workspace.suffix(kind)
        for path in sorted(folder.iterdir()):
            if path.is_dir() or path.name.startswith("."):
                continue
            shown = workspace.shown(path)
            if path.suffix != suffix:
                fix = f"rename it to {path.stem}{suffix}, or move it elsewhere"
                yield Problem(shown, None, f"only {suffix} files are read here", fix)
            elif not NAME.fullmatch(path.stem):
                fix = "use letters, digits, - and _, and start with a letter or digit"
                yield Problem(shown, None, f"'{path.stem}' is no name", fix)


def _lines(study: Study) -> Iterator[str]:
    config = study.config
    yield f"{study.name}: {study.title}, about {study.minutes} minutes"
    for number, (stage_id, stage) in enumerate(
        zip(stage_ids(config.stages), config.stages, strict=True), start=1
    ):
        start = f"  {number:2} {stage_id}: "
        match stage:
            case Consent() | Instructions() | Debrief():
                yield start + f"text '{study.texts[stage.text].title}'"
            case Questions():
                yield start + _questions(study, stage.questionnaire)
            case Tutorial():
                ticks = stage.horizon_ticks or config.horizon_ticks
                yield start + f"{stage.layout} with {stage.agent}, {_seconds(ticks * config.tick_ms)}"
            case Rounds():
                rounds = len(stage.layouts) * len(stage.agents)
                each = _seconds(config.horizon_ticks * config.tick_ms)
                yield start + f"{rounds} rounds of {each} ({config.horizon_ticks} ticks)"
                if stage.after_each is not None:
                    yield f"       after each: {_questions(study, stage.after_each)}"
                kitchens = (
                    k.layout if k.goal is None else f"{k.layout} (goal {k.goal})" for k in stage.layouts
                )
                yield f"       layouts, in this order: {', '.join(kitchens)}"
                order = (
                    "in an order drawn for each layout" if stage.agent_order == "random" else "in this order"
                )
                yield f"       agents, {order}: {', '.join(stage.agents)}"
                yield f"       seat of the participant: {_SEATS[stage.seats]}"
                yield f"       cells: {_cells(stage)}"
            case Comparison():
                which = " and ".join(stage.agents or ()) or "the two partners"
                yield start + f"{_questions(study, stage.questionnaire)}, comparing {which}"
        if stage.title:
            yield f"       titled '{stage.title}'"
    yield f"     hats, drawn for each visit from: {', '.join(config.hats)}"
    yield f"     completion code: {config.completion.code}"


_SEATS = {
    "per_layout": "drawn for each layout",
    "per_round": "drawn for each round",
    0: "always 0",
    1: "always 1",
}


def _questions(study: Study, name: str) -> str:
    return (
        f"questionnaire '{study.questionnaires[name].title}', {len(study.questionnaires[name].items)} items"
    )


def _seconds(ms: int) -> str:
    return f"{ms / 1000:g} s"


def _cells(stage: Rounds) -> str:
    """How many different sequences of agents and seats this stage can draw."""
    agents, layouts = len(stage.agents), len(stage.layouts)
    orders = math.factorial(agents) ** layouts if stage.agent_order == "random" else 1
    drawn = {"per_layout": layouts, "per_round": layouts * agents}.get(str(stage.seats), 0)
    return f"{orders} orders x {2**drawn} seatings"
