"""What is wrong between a study and the agents, layouts and questionnaires that it names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from galley.agents.bundle import Bundle, load_bundle
from galley.errors import InvalidFiles, Problem
from galley.files.reading import Loaded, Loc
from galley.kitchen import Layout
from galley.kitchen.reach import reachable_floor
from galley.names import name_fix
from galley.study.stages.round_step import ALONE
from galley.study.stages.rounds import Tutorial
from galley.study.stages.stage import stage_ids
from galley.study.written.factors import Condition, levels_of
from galley.study.written.questionnaire import Questionnaire
from galley.study.written.study_file import StudyFile
from galley.workspace import Workspace


def agent_problems(
    workspace: Workspace, loaded: Loaded[StudyFile], layouts: Mapping[str, Layout]
) -> list[Problem]:
    """Agents whose files are wrong, or who cannot play on a layout where they are met."""
    problems: list[Problem] = []
    bundles: dict[str, Bundle | None] = {}
    told: set[tuple[str, Loc]] = set()
    for agent, layout, loc in _meetings(loaded.value):
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
            message = f"agent '{agent}' cannot play on '{layout}'"
            if (message, loc) not in told:
                told.add((message, loc))
                fix = f"it plays on {known}; choose another agent or layout"
                problems.append(loaded.problem(loc, message, fix))
    return problems


def _meetings(config: StudyFile) -> Iterator[tuple[str, str, Loc]]:
    """(agent, layout, place of the agent in the file) of every round that some visit may play."""
    for place, stage in enumerate(config.stages):
        for written, kitchen, loc in stage.meetings():
            for agent in levels_of(written, config.factors):
                for layout in levels_of(kitchen, config.factors):
                    yield agent, layout, ("stages", place, *loc)


def kitchen_problems(loaded: Loaded[StudyFile], layouts: Mapping[str, Layout]) -> Iterator[Problem]:
    """Tutorials alone in which the chef who is not drawn would stand in the way."""
    for place, stage in enumerate(loaded.value.stages):
        if not isinstance(stage, Tutorial) or stage.agent != ALONE:
            continue
        for name in levels_of(stage.layout, loaded.value.factors):
            if name not in layouts:
                continue
            starts = layouts[name].starts
            if starts[1 - int(stage.seat)] in reachable_floor(layouts[name], starts[int(stage.seat)]):
                told = f"the start of the other seat on '{name}' is not walled off from seat {stage.seat}"
                fix = "use a layout such as practice_alone, or the agent stay, which is drawn"
                yield loaded.problem(("stages", place, "layout"), told, fix)


def questionnaire_problems(
    loaded: Loaded[StudyFile], questionnaires: Mapping[str, Questionnaire]
) -> Iterator[Problem]:
    """Questionnaires in stages that they are not made for, and conditions on what is not asked."""
    config = loaded.value
    before: dict[str, tuple[str, ...]] = {}
    for place, (stage_id, stage) in enumerate(zip(stage_ids(config.stages), config.stages, strict=True)):
        for n, condition in enumerate(stage.conditions):
            if condition.item is not None:
                known = {
                    name: [questionnaires[q] for q in asked if q in questionnaires]
                    for name, asked in before.items()
                }
                for key, message, fix in _condition_faults(condition, known):
                    yield loaded.problem(("stages", place, "when", *_at(loaded, place, n), key), message, fix)
        for kind, written, loc in stage.names():
            for name in levels_of(written, config.factors) if kind == "questionnaires" else ():
                if name in questionnaires:
                    for message, fix in stage.questionnaire_faults(name, questionnaires[name]):
                        yield loaded.problem(("stages", place, *loc), message, fix)
        if stage.asks is not None:
            before[stage_id] = levels_of(stage.asks, config.factors)


def _at(loaded: Loaded[StudyFile], place: int, n: int) -> tuple[int, ...]:
    """The place of a condition in the file, where one alone need not stand in a list."""
    return (n,) if ("stages", place, "when", n) in loaded.lines else ()


def _condition_faults(
    condition: Condition, before: Mapping[str, Iterable[Questionnaire]]
) -> Iterator[tuple[str, str, str]]:
    """(key, what is wrong, fix) of a condition on an item of a stage that comes `before`."""
    stage, _, name = str(condition.item).partition(".")
    if stage not in before:
        told = f"no stage before this one that asks questions is named '{stage}'"
        yield "item", told, name_fix(stage, before)
        return
    for questionnaire in before[stage]:
        items = {item.id: item for item in questionnaire.items}
        item = items.get(name)
        if item is None:
            yield "item", f"stage '{stage}' asks for no item '{name}'", name_fix(name, items)
            continue
        options = item.choosable
        for key in ("any_of", "none_of"):
            for value in getattr(condition, key):
                if options and value not in options:
                    yield key, f"'{value}' is no option of '{name}'", f"use one of {' '.join(options)}"
        compares = condition.at_least is not None or condition.at_most is not None
        if compares and not item.numeric:
            key = "at_most" if condition.at_least is None else "at_least"
            yield key, f"the answer to '{name}' is no number", "use any_of or none_of"
