"""Translates messages into one language."""

from __future__ import annotations

import gettext


class Translator:
    """Translates messages into one language; what has no translation stays in English."""

    def __init__(self, language: str, catalogue: gettext.NullTranslations) -> None:
        self.language = language
        self.catalogue = catalogue

    def __call__(self, message: str) -> str:
        """The message in this language, its `{places}` not filled in yet."""
        return self.gettext(message)

    def gettext(self, message: str) -> str:
        """The message in this language; an empty one stays empty."""
        return self.catalogue.gettext(message) if message else message

    def ngettext(self, one: str, many: str, n: int) -> str:
        """The form of the message that this language uses for a number."""
        return self.catalogue.ngettext(one, many, n)
