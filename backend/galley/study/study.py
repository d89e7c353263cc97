"""A study ready to run: its file and every file it names, in each language, checked against each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from galley.errors import InvalidFiles, Problem
from galley.files.reading import Document, Loaded, read
from galley.kitchen import Layout
from galley.outcomes import TurnedAway, VisitOutcome
from galley.study.estimate import Ranges, in_figures, ranges
from galley.study.visit.steps import QuestionsStep
from galley.study.written.crosscheck import agent_problems, kitchen_problems, questionnaire_problems
from galley.study.written.named_files import (
    catalogue_problems,
    content_sha256,
    known_layouts_of,
    text_file,
)
from galley.study.written.pictures import Picture
from galley.study.written.questionnaire import Questionnaire, load_questionnaire, why_not_in
from galley.study.written.recruitment import Ending, filled, kept, load_invitations
from galley.study.written.study_file import StudyFile, names_of
from galley.study.written.texts import PageText, load_text
from galley.workspace import Kind, Workspace

__all__ = ["Study", "known_layouts_of", "load_study"]

CHECKED_KINDS: tuple[Kind, ...] = ("agents", "questionnaires", "texts", "invitations")


@dataclass(frozen=True)
class Quoted:
    """Texts, and the numbers in them: the least and the most that the visits meet who read them."""

    texts: Mapping[str, PageText]
    numbers: Ranges


@dataclass(frozen=True)
class Study:
    """A validated study in one of its languages; `layouts` maps the names used in the file (aliases too).

    `sha256` covers the study file, every questionnaire, text and layout file that it names, in every
    language, and the workspace's catalogues of these languages; agents have hashes of their own, and
    invitations may be added while a study runs.
    """

    name: str
    config: StudyFile
    questionnaires: Mapping[str, Questionnaire]
    quoted: Quoted
    layouts: Mapping[str, Layout]
    sha256: str
    language: str = "en"
    invitations: frozenset[str] | None = None
    translations: Mapping[str, Study] = field(default_factory=dict, repr=False, compare=False)
    """The study in each of its languages, by code."""
    by_condition: Mapping[tuple[str, ...], Quoted] = field(default_factory=dict, repr=False, compare=False)
    """What visits of each condition are told, by the levels of the factors in their order."""

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
        """How long a visit takes at most: as written, else estimated."""
        return self.quoted.numbers["minutes"][1]

    @property
    def minutes_told(self) -> str:
        """How long a visit takes, in figures: the least and the most where visits differ."""
        return in_figures(*self.quoted.numbers["minutes"])

    @property
    def texts(self) -> Mapping[str, PageText]:
        """Every text, with the numbers that visits meet."""
        return self.quoted.texts

    @property
    def pictures(self) -> Iterator[Picture]:
        """Every picture of its own on its texts, in all languages; one may come several times."""
        for study in self.translations.values():
            for text in study.texts.values():
                yield from text.pictures

    @property
    def agents(self) -> tuple[str, ...]:
        """Every agent that a visit may meet, each once."""
        return tuple(name for name in names_of(self.config, "agents") if name != "human")

    @property
    def languages(self) -> tuple[str, ...]:
        """The languages that participants may choose from; the first is the study's own."""
        return self.config.languages

    def in_language(self, code: str) -> Study:
        """The same study with every word in one of its languages; the study itself for any other code."""
        return self.translations.get(code, self)

    def met_by(self, condition: Mapping[str, Any]) -> Study:
        """The same study with the numbers of one condition in its texts; itself where that is unknown."""
        levels = tuple(str(condition.get(name, "")) for name in self.config.factors)
        return replace(self, quoted=self.by_condition.get(levels, self.quoted))

    def questionnaire_for(self, step: QuestionsStep) -> Questionnaire:
        """The questionnaire of a step, with the order and the right answers of the visit's plan."""
        questionnaire = self.questionnaires[step.questionnaire]
        if step.item_order is not None:
            questionnaire = questionnaire.arranged(step.item_order)
        return questionnaire.expecting(step.expected)

    def ending(self, outcome: VisitOutcome | TurnedAway, link_params: Mapping[str, str]) -> Ending:
        """What a visit that ended so, or could not begin, is shown.

        Its redirect carries the code and the link's parameters.
        """
        if outcome == "completed":
            done = self.config.completion
            text = next(s.text for s in self.config.stages if s.kind == "debrief")
            return Ending(outcome, text, done.code, filled(done.redirect, done.code, link_params))
        end = getattr(self.config.endings, outcome)
        if outcome == "partner_lost" and not end.model_fields_set:
            end = self.config.endings.partner_missing
        return Ending(outcome, end.text, end.code, filled(end.redirect, end.code, link_params))

    def kept(self, link_params: Mapping[str, str]) -> dict[str, str]:
        """Those of a link's parameters that the study stores."""
        return kept(link_params, self.config.recruitment.keep)


def load_study(workspace: Workspace, name: str) -> Study:
    """The study of this name in its first language, with all that it names; `in_language` gives the others.

    Raises:
        GalleyError: the workspace has no such study.
        InvalidFiles: everything that is wrong with its file and with the files that it names.
    """
    path = workspace.find("studies", name)
    problems: list[Problem] = []
    layouts, known_layouts = known_layouts_of(workspace, problems)
    context: dict[str, tuple[str, ...]] = {"layouts": known_layouts}
    context |= {kind: workspace.names(kind) for kind in CHECKED_KINDS}
    try:
        document = read(path, workspace.shown(path))
        loaded = document.validated(StudyFile, context)
    except InvalidFiles as invalid:
        raise InvalidFiles([*problems, *invalid.problems]) from None
    problems += catalogue_problems(workspace)
    problems += agent_problems(workspace, loaded, layouts)
    problems += kitchen_problems(loaded, layouts)
    invitations = _invitations(workspace, loaded.value, problems)
    used = {n: layouts[n] for n in names_of(loaded.value, "layouts") if n in layouts}
    sha256 = content_sha256(workspace, name, loaded.value, used.values())
    studies: dict[str, Study] = {}
    for code in loaded.value.languages:
        reader = _Reader(workspace, code, loaded.value.languages, layouts, problems)
        found = reader.parts(document, context)
        if found is not None:
            config, asked, quoted, by_condition = found
            studies[code] = Study(
                name, config, asked, quoted, used, sha256, code, invitations, studies, by_condition
            )
    if problems:
        raise InvalidFiles(problems)
    return next(iter(studies.values()))


@dataclass(frozen=True)
class _Reader:
    """Reads a study and what it names in one language; what is wrong joins `problems`."""

    workspace: Workspace
    language: str
    languages: tuple[str, ...]
    layouts: Mapping[str, Layout]
    problems: list[Problem]

    def parts(
        self, document: Document, context: Mapping[str, tuple[str, ...]]
    ) -> tuple[StudyFile, dict[str, Questionnaire], Quoted, dict[tuple[str, ...], Quoted]] | None:
        """The study file, questionnaires and texts, for all and by condition; None when the file is wrong."""
        spoken = {"language": self.language, "languages": self.languages}
        try:
            loaded = document.validated(StudyFile, {**context, **spoken})
        except InvalidFiles as invalid:
            self.problems.extend(invalid.problems)
            # Its words lack in this language; what else lacks is in the files that it names.
            loaded, whole = document.validated(StudyFile, context), False
        else:
            whole = True
        config = loaded.value
        read = {}
        for name in names_of(config, "questionnaires"):
            file = self.workspace.find("questionnaires", name)
            shown = self.workspace.shown(file)
            try:
                read[name] = load_questionnaire(file, shown, spoken).value
            except InvalidFiles as invalid:
                self.problems.extend(invalid.problems)
                self.problems.extend(why_not_in(self.language, file, shown, invalid.problems))
        self.problems.extend(questionnaire_problems(loaded, read))
        everybody = self._quoted(loaded, ranges(config, read, config.conditions()))
        made = {tuple(everybody.numbers.values()): everybody}
        by_condition = {}
        for condition in config.conditions():
            numbers = ranges(config, read, [condition])
            key = tuple(numbers.values())
            if key not in made:
                made[key] = self._quoted(loaded, numbers)
            by_condition[tuple(condition.values())] = made[key]
        return (config, read, everybody, by_condition) if whole else None

    def _quoted(self, loaded: Loaded[StudyFile], numbers: Ranges) -> Quoted:
        """Every text that can be read, with these numbers in it."""
        texts = {name: self._text(loaded, name, numbers) for name in names_of(loaded.value, "texts")}
        return Quoted({name: text for name, text in texts.items() if text is not None}, numbers)

    def _text(self, loaded: Loaded[StudyFile], name: str, numbers: Ranges) -> PageText | None:
        grids = {name: layout.grid for name, layout in self.layouts.items()} or None
        values = {name: in_figures(*both) for name, both in numbers.items()}
        own = self.language == loaded.value.languages[0]
        file = text_file(self.workspace, name, self.language, own=own)
        if file is None:
            told = f"text '{name}' is not there in '{self.language}'"
            fix = f"write {self.workspace.shown(self.workspace.folder('texts'))}/{name}.{self.language}.md"
            self.problems.append(loaded.problem(("languages",), told, fix))
            return None
        try:
            return load_text(file, self.workspace.shown(file), grids, values)
        except InvalidFiles as invalid:
            self.problems.extend(invalid.problems)
            return None


def _invitations(workspace: Workspace, config: StudyFile, problems: list[Problem]) -> frozenset[str] | None:
    name = config.recruitment.invitations
    if name is None:
        return None
    path = workspace.find("invitations", name)
    try:
        return load_invitations(path, workspace.shown(path))
    except InvalidFiles as invalid:
        problems += invalid.problems
        return frozenset()
