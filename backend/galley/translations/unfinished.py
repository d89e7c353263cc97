"""A catalogue to fill in: every message that a language lacks, for an editor of such files."""

from __future__ import annotations

from io import StringIO

from babel import Locale, UnknownLocaleError
from babel.messages.catalog import Catalog
from babel.messages.pofile import escape, read_po

from galley.translations.catalogue_file import Forms
from galley.translations.catalogues import Catalogues

HEAD = """\
# Words of the pages in one language; docs/translations.md tells how they are kept.
msgid ""
msgstr ""
"Language: {language}\\n"
"Plural-Forms: nplurals={forms}; plural={choice};\\n"
"MIME-Version: 1.0\\n"
"Content-Type: text/plain; charset=utf-8\\n"
"Content-Transfer-Encoding: 8bit\\n"
"""


def unfinished(language: str, catalogues: Catalogues, text: str = "") -> tuple[str, int]:
    """(`text` with the messages at its end that the language lacks and it does not hold yet, their number).

    `text` is a catalogue that can be read; without one a new one is begun.
    """
    try:
        rules = Catalog(locale=Locale.parse(language, sep="-"))
    except (ValueError, UnknownLocaleError):
        rules = Catalog()
    if text:
        rules = read_po(StringIO(text), locale=rules.locale)
    else:
        text = HEAD.format(
            language=language.replace("-", "_"), forms=rules.num_plurals, choice=rules.plural_expr
        )
    held = {message.id if isinstance(message.id, str) else message.id[0] for message in rules}
    lacking = [catalogues.messages[first] for first in catalogues.lacking(language) if first not in held]
    parts = [text.rstrip("\n"), *(_to_fill_in(forms, rules.num_plurals) for forms in lacking)]
    return "\n\n".join(parts) + "\n", len(lacking)


def _to_fill_in(forms: Forms, plurals: int) -> str:
    if len(forms) == 1:
        return f'msgid {escape(forms[0])}\nmsgstr ""'
    blank = "\n".join(f'msgstr[{n}] ""' for n in range(plurals))
    return f"msgid {escape(forms[0])}\nmsgid_plural {escape(forms[1])}\n{blank}"
