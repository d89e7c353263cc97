"""What participants read, in their language: gettext catalogues, read as translators write them."""

from __future__ import annotations

import gettext
from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Final

from babel import Locale, UnknownLocaleError
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po

SOURCE: Final = "en"
"""The language in which the messages are written in the code and the templates."""

DOMAIN: Final = "galley"
FOLDER: Final = Path(__file__).parent / "locale"

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


class Translator:
    """Translates messages into one language; what has no translation stays in English."""

    def __init__(self, language: str, catalogue: gettext.NullTranslations) -> None:
        self.language = language
        self._catalogue = catalogue

    def __call__(self, message: str) -> str:
        """The message in this language, its `{places}` not filled in yet."""
        return self.gettext(message)

    def gettext(self, message: str) -> str:
        """The message in this language; an empty one stays empty."""
        return self._catalogue.gettext(message) if message else message

    def ngettext(self, one: str, many: str, n: int) -> str:
        """The form of the message that this language uses for a number."""
        return self._catalogue.ngettext(one, many, n)


class Catalogues:
    """The languages that pages can speak; built once and handed down."""

    def __init__(self, translators: Iterable[Translator]) -> None:
        source = Translator(SOURCE, gettext.NullTranslations())
        self._translators = {one.language.lower(): one for one in (source, *translators)}

    @classmethod
    def load(cls, folder: Path = FOLDER) -> Catalogues:
        """All `<language>/LC_MESSAGES/galley.po` below a folder; messages marked fuzzy are left out."""
        files = sorted(folder.glob(f"*/LC_MESSAGES/{DOMAIN}.po"))
        return cls(Translator(file.parts[-3].replace("_", "-"), _read(file)) for file in files)

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


def language_name(code: str) -> str:
    """What a language calls itself: `zh` is 中文; the code itself for one that nobody knows."""
    try:
        name = Locale.parse(code, sep="-").get_display_name(code.replace("-", "_"))
    except (ValueError, UnknownLocaleError):
        name = None
    return name[0].upper() + name[1:] if name else code


def _read(file: Path) -> gettext.GNUTranslations:
    with file.open("rb") as opened:
        catalogue = read_po(opened, domain=DOMAIN)
    compiled = BytesIO()
    write_mo(compiled, catalogue)
    compiled.seek(0)
    return gettext.GNUTranslations(compiled)
