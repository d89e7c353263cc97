"""The languages that pages can speak: catalogues that are shipped, and over them a workspace's own."""

from __future__ import annotations

import gettext
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

from babel import Locale, UnknownLocaleError

from galley.errors import InvalidFiles, Problem
from galley.translations.catalogue_file import CatalogueFile, Forms, read_catalogue
from galley.translations.translator import Translator

SOURCE: Final = "en"
"""The language in which the messages are written in the code and the templates."""

DOMAIN: Final = "galley"
FOLDER: Final = Path(__file__).parents[1] / "locale"
LANGUAGE: Final = r"[a-z]{2,3}(-[A-Za-z0-9]{2,8})*"
"""Codes of languages as browsers send them: `en`, `zh`, `pt-BR`. Source: BCP 47."""


KEYWORDS: Final[Mapping[str, tuple[int, ...] | None]] = {
    "_": None,
    "gettext": None,
    "ngettext": (1, 2),
    "say": None,
    "_say": None,
    "mark": None,
}
"""Calls whose literal arguments are messages, as Babel's extractors want them."""


def mark(message: str) -> str:
    """The message unchanged; marks a constant whose translation is looked up later."""
    return message


class Catalogues:
    """The languages that pages can speak; built once and handed down."""

    def __init__(self, translators: Iterable[Translator]) -> None:
        source = Translator(SOURCE, gettext.NullTranslations())
        self._translators = {one.language.lower(): one for one in (source, *translators)}
        self._forms: dict[str, set[str]] = {}
        self.messages: Mapping[str, Forms] = {}
        """Every message of Galley, by the first of its forms."""
        self.remarks: tuple[Problem, ...] = ()
        """What is worth a look in a workspace's own catalogues."""

    @classmethod
    def load(cls, own: Path | None = None) -> Catalogues:
        """The catalogues that are shipped, and over each, message by message, the one in a folder of `own`.

        `own` holds a `LANGUAGE.po` for each language, such as `pt-BR.po` or `pt_BR.po`; it need not exist.
        What the catalogue of a region leaves out is looked up in that of its language, then in English.

        Raises:
            InvalidFiles: all that is wrong with the catalogues in `own`.
        """
        shipped = {file.parts[-3]: read_catalogue(file, file.parts[-3]) for file in shipped_files()}
        messages = {first: forms for one in shipped.values() for first, forms in one.forms.items()}
        added = _own(own, messages) if own is not None and own.is_dir() else {}
        source = added.get(SOURCE)
        known = cls([Translator(SOURCE, source.words)] if source else [])
        known.messages = messages
        known.remarks = tuple(remark for one in added.values() for remark in one.remarks)
        for language in sorted({*shipped, *added} - {SOURCE}, key=lambda code: (len(code), code)):
            files = [one[language] for one in (shipped, added) if language in one]
            known._add(language, files)
        return known

    def _add(self, language: str, files: Sequence[CatalogueFile]) -> None:
        """Take up a language: the last of its files first, then the others, then the language around it."""
        around = self.translator(language)
        self._forms[language.lower()] = set(self._forms.get(around.language.lower(), ()))
        words: gettext.NullTranslations = around.catalogue
        for file in files:
            file.words.add_fallback(words)
            words = file.words
            self._forms[language.lower()] |= file.forms.keys()
        self._translators[language.lower()] = Translator(language, words)

    @property
    def languages(self) -> tuple[str, ...]:
        """Codes of all languages, the source first."""
        return tuple(one.language for one in self._translators.values())

    def translator(self, language: str) -> Translator:
        """The translator for a code as browsers send it: `zh` serves `zh-CN`; English for what is unknown."""
        code = language.replace("_", "-").lower()
        while code:
            if code in self._translators:
                return self._translators[code]
            code = code.rpartition("-")[0]
        return self._translators[SOURCE]

    def lacking(self, language: str) -> tuple[str, ...]:
        """The messages that participants of a language read in English, in the order of the catalogues."""
        if language.replace("_", "-").lower().partition("-")[0] == SOURCE:
            return ()
        said = self._forms.get(self.translator(language).language.lower(), set())
        return tuple(message for message in self.messages if message not in said)


def shipped_files() -> list[Path]:
    """The catalogues that come with Galley."""
    return sorted(FOLDER.glob(f"*/LC_MESSAGES/{DOMAIN}.po"))


def language_name(code: str) -> str:
    """What a language calls itself: `zh` is 中文; the code itself for one that nobody knows."""
    try:
        name = Locale.parse(code, sep="-").get_display_name(code.replace("-", "_"))
    except (ValueError, UnknownLocaleError):
        name = None
    return name[0].upper() + name[1:] if name else code


def text_direction(code: str) -> str:
    """How a language is written: `rtl` from the right, else `ltr`."""
    try:
        return Locale.parse(code, sep="-").text_direction
    except (ValueError, UnknownLocaleError):
        return "ltr"


def _own(folder: Path, messages: Mapping[str, Forms]) -> dict[str, CatalogueFile]:
    """A workspace's own catalogues by language.

    Raises:
        InvalidFiles: all that is wrong with them.
    """
    read: dict[str, CatalogueFile] = {}
    problems: list[Problem] = []
    for file in sorted(folder.glob("*.po")):
        shown, language = f"{folder.name}/{file.name}", file.stem.replace("_", "-")
        if not re.fullmatch(LANGUAGE, language):
            told = f"'{file.stem}' is no code of a language"
            problems.append(Problem(shown, None, told, "rename it to one such as de.po or pt-BR.po"))
        elif language.lower() in {one.lower() for one in read}:
            told = f"there is another catalogue for '{language}'"
            problems.append(Problem(shown, None, told, "make one file of both"))
        else:
            try:
                read[language] = read_catalogue(file, language, shown, messages)
            except InvalidFiles as invalid:
                problems += invalid.problems
    if problems:
        raise InvalidFiles(problems)
    return read
