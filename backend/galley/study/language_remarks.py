"""What participants would read in another language than they chose, told before they come."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final, get_args

from galley.errors import GalleyError, Problem
from galley.files.reading import Document, FileModel, Loc, read
from galley.study.study import Study
from galley.study.written.languages import SAID_IN_LANGUAGES
from galley.study.written.named_files import text_file
from galley.study.written.questionnaire import Questionnaire
from galley.translations import MOST_LISTED, SOURCE, Catalogues, shortened
from galley.workspace import Workspace

NOT_SHOWN: Final = ("source", "translations")
"""Words of a file that participants never read."""


def language_remarks(workspace: Workspace, study: Study, document: Document) -> Iterator[Problem]:
    """Remarks on each language of a study: its catalogue, its own words, its questionnaires and texts."""
    line = document.lines.get(("languages",), 1)
    yield from _catalogues(workspace, study, document.path, line)
    yield from _plain_words(document, study.config, study.languages, study.languages[0])
    for name, questionnaire in study.questionnaires.items():
        file = workspace.find("questionnaires", name)
        written_in = questionnaire.language or study.languages[0]
        asked = read(file, workspace.shown(file))
        yield from _plain_words(asked, questionnaire, study.languages, written_in)
    yield from _english_texts(workspace, study)


def _catalogues(workspace: Workspace, study: Study, shown: str, line: int) -> Iterator[Problem]:
    """Messages of ours that a language lacks, and what is worth a look in the workspace's catalogues."""
    catalogues = Catalogues.load(workspace.folder("catalogues"))
    yield from catalogues.remarks
    for language in study.languages:
        lacking = catalogues.lacking(language)
        if not lacking:
            continue
        fix = (
            f"`galley studies catalogue {language}` writes what is to be translated, see docs/translations.md"
        )
        if len(lacking) == len(catalogues.messages):
            told = f"there is no catalogue for '{language}': buttons and errors are shown in English"
        else:
            first = ", ".join(f"'{shortened(message)}'" for message in lacking[:MOST_LISTED])
            more = f" and {len(lacking) - MOST_LISTED} more" if len(lacking) > MOST_LISTED else ""
            count = f"{len(lacking)} of {len(catalogues.messages)} messages"
            told = f"{count} of buttons and errors are not in '{language}': {first}{more}"
        yield Problem(shown, line, told, fix)


def _plain_words(
    document: Document, model: FileModel, languages: tuple[str, ...], written_in: str
) -> Iterator[Problem]:
    """Words that are written once, for all languages: each, or the questionnaire that has no others."""
    found = list(_words(model, document.data, ()))
    plain = [(loc, words) for loc, words in found if isinstance(words, str) and _says_something(words)]
    told_why = model.translations if isinstance(model, Questionnaire) else ""
    why = f" ({told_why})" if told_why else ""
    for language in languages:
        if _same(language, written_in) or not plain:
            continue
        places = {(document.lines.get(loc, 1), str(words)): loc for loc, words in reversed(plain)}
        if len(plain) == len(found) and isinstance(model, Questionnaire):
            told = f"none of its {len(plain)} texts is in '{language}': they are shown as they are{why}"
            fix = f"write each as {{{written_in}: ..., {language}: ...}}"
            yield Problem(document.path, document.lines.get(("title",), 1), told, fix)
            continue
        for (line, words), loc in sorted(places.items()):
            key = next(str(part) for part in reversed(loc) if isinstance(part, str))
            told = f"'{key}' is not in '{language}', so '{shortened(words)}' is shown"
            yield Problem(document.path, line, told, f"write {{{written_in}: ..., {language}: ...}}")


def _same(language: str, other: str) -> bool:
    return language.partition("-")[0] == other.partition("-")[0]


def _says_something(words: str) -> bool:
    return any(letter.isalpha() for letter in words)


def _words(value: Any, data: Any, loc: Loc) -> Iterator[tuple[Loc, object]]:
    """(place in the file, what stands there) of all that participants read in a model made from `data`."""
    if isinstance(value, FileModel) and isinstance(data, Mapping):
        for name, field in type(value).model_fields.items():
            key = field.alias or name
            if key not in data or name in NOT_SHOWN:
                continue
            if SAID_IN_LANGUAGES in field.metadata:
                yield (*loc, key), data[key]
            elif isinstance(data[key], list) and _spoken(field.annotation):
                yield from (((*loc, key, place), words) for place, words in enumerate(data[key]))
            elif _spoken(field.annotation) and not isinstance(getattr(value, name), FileModel):
                yield (*loc, key), data[key]
            else:
                yield from _words(getattr(value, name), data[key], (*loc, key))
    elif isinstance(value, Mapping) and isinstance(data, Mapping):
        for key in data.keys() & value.keys():
            yield from _words(value[key], data[key], (*loc, key))
    elif isinstance(value, tuple) and isinstance(data, list) and len(value) == len(data):
        for place, (one, written) in enumerate(zip(value, data, strict=True)):
            yield from _words(one, written, (*loc, place))


def _spoken(annotation: Any) -> bool:
    """Whether an annotation holds words in languages: `Words | None` or `tuple[Words, ...]`."""
    if SAID_IN_LANGUAGES in getattr(annotation, "__metadata__", ()):
        return True
    return any(_spoken(part) for part in get_args(annotation))


def _english_texts(workspace: Workspace, study: Study) -> Iterator[Problem]:
    """Texts of a study in another language that are, word by word, the English ones that Galley brings."""
    own = study.languages[0]
    if _same(own, SOURCE):
        return
    try:
        starter = Workspace(Workspace.starter())
    except GalleyError:
        return
    for name in study.texts:
        file = text_file(workspace, name, own, own=True)
        if file is None or file.stem not in starter.names("texts") or file.stem != name:
            continue
        if file.read_bytes() == starter.find("texts", name).read_bytes():
            shown = workspace.shown(file)
            told = f"this is the English text that Galley brings, shown in '{own}'"
            yield Problem(shown, 1, told, f"write {shown.removesuffix('.md')}.{own}.md")
