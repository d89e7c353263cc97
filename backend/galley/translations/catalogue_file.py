"""One catalogue as a translator writes it (.po), with what is wrong in it and what is worth a look."""

from __future__ import annotations

import gettext
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO, StringIO
from pathlib import Path
from typing import Final

from babel import Locale, UnknownLocaleError
from babel.messages.catalog import Catalog, Message
from babel.messages.mofile import write_mo
from babel.messages.pofile import PoFileError, denormalize, read_po

from galley.errors import InvalidFiles, Problem
from galley.names import nearest

Forms = tuple[str, ...]
"""A message in English: itself, or its forms for one and for many."""

MOST_LISTED: Final = 3
"""How many messages a remark quotes."""

_PLACE: Final = re.compile(r"%\(\w+\)s|\{\w+\}|<[^<>]*>")
"""What stands in a message for something else, and tags."""
_MARKS: Final = re.compile(r"[%{}<\"]")
"""What breaks a page where it is no part of a place or a tag; a quote ends an attribute."""
_QUOTED: Final = r'"(?:[^"\\]|\\.)*"'
_LINE: Final = re.compile(rf"(?:(msgctxt|msgid_plural|msgid|msgstr(?:\[\d+\])?)\s*)?({_QUOTED})")


@dataclass(frozen=True)
class CatalogueFile:
    """A catalogue that can be used: the messages that it says whole, and remarks on the others."""

    language: str
    words: gettext.GNUTranslations
    forms: Mapping[str, Forms]
    """The messages that are translated, by the first of their forms."""
    remarks: tuple[Problem, ...] = ()


def read_catalogue(
    path: Path, language: str, shown: str | None = None, known: Mapping[str, Forms] | None = None
) -> CatalogueFile:
    """The catalogue of a language in a file; messages call the file `shown`.

    What is fuzzy, empty, without one of its plural forms or not among the `known` messages is left out.

    Raises:
        InvalidFiles: the file cannot be read, or one of its messages would break a page.
    """
    name = shown or path.as_posix()
    text = _text(path, name)
    catalogue = _parsed(text, language, name)
    problems: list[Problem] = []
    remarks: list[Problem] = []
    kept = Catalog(locale=catalogue.locale, header_comment="", charset="utf-8")
    kept.mime_headers, kept.charset = catalogue.mime_headers, "utf-8"
    forms: dict[str, Forms] = {}
    for message in catalogue:
        english = _forms(message)
        if not english[0]:
            continue
        if known is not None and (message.context or known.get(english[0]) != english):
            remarks.append(_unknown(name, message, known))
            continue
        said = (message.string,) if isinstance(message.string, str) else tuple(message.string or ())
        if message.fuzzy or not any(words.strip() for words in said):
            continue
        broken = [problem for words in said if words for problem in _broken(name, message, words)]
        problems += broken
        missing = sum(not words.strip() for words in said)
        if missing:
            remarks.append(_without_forms(name, message, len(said), missing))
        elif not broken:
            kept[message.id] = message
            forms[english[0]] = english
    if problems:
        raise InvalidFiles(problems)
    return CatalogueFile(language, _compiled(kept, text, name), forms, tuple(remarks))


def _text(path: Path, name: str) -> str:
    try:
        raw = path.read_bytes()
    except OSError as error:
        told = f"cannot be read ({error.strerror or error})"
        raise InvalidFiles(
            [Problem(name, None, told, "check that the file is there and may be read")]
        ) from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InvalidFiles([Problem(name, line, "the text is not UTF-8", "save the file as UTF-8")]) from None


def _parsed(text: str, language: str, name: str) -> Catalog:
    problems = list(_misread(text, name))
    if problems:
        raise InvalidFiles(problems)
    try:
        locale: Locale | None = Locale.parse(language, sep="-")
    except (ValueError, UnknownLocaleError):
        locale = None
    try:
        return read_po(StringIO(text), locale=locale, abort_invalid=True)
    except PoFileError as error:
        told, _, _ = str(error).partition(" on ")
        fix = "write each message as msgid and msgstr, as docs/translations.md shows"
        raise InvalidFiles([Problem(name, error.lineno + 1, f"not a catalogue: {told}", fix)]) from None
    except ValueError as error:
        wrong = "Plural-Forms" if "int()" in str(error) else "Language"
        raise InvalidFiles([_wrong_header(name, text, wrong, error)]) from None


def _misread(text: str, name: str) -> Iterator[Problem]:
    """Lines that are none of a catalogue, and messages that stand twice: Babel says nothing of either."""
    found: dict[tuple[str, str], int] = {}
    read = {"msgctxt": "", "msgid": ""}
    keyword, start = "", 1
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if not stripped or stripped.startswith("#"):
            continue
        match = _LINE.fullmatch(stripped)
        if match is None:
            fix = 'write msgid "..." or msgstr "...", with \\" for a quote inside'
            yield Problem(name, number, "this is no line of a catalogue", fix)
            continue
        words = denormalize(match[2])
        if match[1] is None:
            read[keyword] = read.get(keyword, "") + words
            continue
        if match[1] == "msgctxt" or (match[1] == "msgid" and keyword != "msgctxt"):
            read, start = {"msgctxt": ""}, number
        read[match[1]] = words
        if match[1] in ("msgstr", "msgstr[0]"):
            key = (read["msgctxt"], read.get("msgid", ""))
            if key in found:
                told = f"message '{shortened(key[1])}' stands here again (first on line {found[key]})"
                yield Problem(name, start, told, "keep one of the two")
            found.setdefault(key, start)
        keyword = match[1]


def _wrong_header(name: str, text: str, wrong: str, error: ValueError) -> Problem:
    """What is wrong with the lines at the top that say in which language the catalogue is."""
    lines = text.splitlines()
    line = next((number for number, told in enumerate(lines, start=1) if f'"{wrong}' in told), 1)
    fix = 'write one as for English: "Plural-Forms: nplurals=2; plural=(n != 1);\\n"'
    if wrong == "Language":
        fix = 'write the code of the language: "Language: de\\n"'
    return Problem(name, line, f"its header '{wrong}' cannot be read ({error})", fix)


def _compiled(catalogue: Catalog, text: str, name: str) -> gettext.GNUTranslations:
    compiled = BytesIO()
    write_mo(compiled, catalogue)
    compiled.seek(0)
    try:
        return gettext.GNUTranslations(compiled)
    except ValueError as error:
        raise InvalidFiles([_wrong_header(name, text, "Plural-Forms", error)]) from None


def _forms(message: Message) -> Forms:
    return (message.id,) if isinstance(message.id, str) else tuple(message.id)


def _unknown(name: str, message: Message, known: Mapping[str, Forms]) -> Problem:
    english = _forms(message)
    if message.context:
        told = f"message '{shortened(english[0])}' has a msgctxt, which no message of Galley has"
        return Problem(name, message.lineno, told, "remove that line")
    if english[0] in known:
        told = f"message '{shortened(english[0])}' is another one in Galley"
        wanted = "with msgid_plural" if len(known[english[0]]) > 1 else "without msgid_plural"
        return Problem(name, message.lineno, told, f"write it {wanted}")
    close = nearest(english[0], known)
    fix = (
        f"did you mean '{shortened(close)}'?"
        if close
        else "remove it, or write the English words as Galley does"
    )
    return Problem(name, message.lineno, f"Galley has no message '{shortened(english[0])}'", fix)


def _without_forms(name: str, message: Message, wanted: int, missing: int) -> Problem:
    told = f"message '{shortened(_forms(message)[0])}' has {wanted - missing} of the {wanted} forms"
    fix = f"write msgstr[0] to msgstr[{wanted - 1}], or mend the header Plural-Forms"
    return Problem(name, message.lineno, f"{told} that numbers need, so it is left out", fix)


def _broken(name: str, message: Message, words: str) -> Iterator[Problem]:
    """What of a translation would break a page: places and tags unlike those of the English message."""
    english = _forms(message)[-1]
    wanted, got = set(_PLACE.findall(english)), set(_PLACE.findall(words))
    about = f"the translation of '{shortened(_forms(message)[0])}'"
    if wanted != got:
        lost = [f"lacks {place}" for place in sorted(wanted - got)]
        extra = [f"has {place}, which is not in the English" for place in sorted(got - wanted)]
        told = f"{about} {' and '.join(lost + extra)}"
        yield Problem(name, message.lineno, told, "keep %(...)s, {...} and tags as they are in the English")
        return
    stray = sorted(set(_MARKS.findall(_PLACE.sub("", words))) - set(_MARKS.findall(_PLACE.sub("", english))))
    if stray:
        told = f"{about} has a {' and a '.join(stray)} that belongs to no place"
        yield Problem(
            name, message.lineno, told, "leave it out, or write it in words; “ and ” are good quotes"
        )


def shortened(words: str) -> str:
    """The beginning of a message, for quoting it."""
    return words if len(words) <= 50 else words[:47] + "..."
