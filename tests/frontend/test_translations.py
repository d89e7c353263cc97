"""Every word that participants read comes from a catalogue, and every shipped language has all of them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from babel.messages.extract import extract_from_file
from babel.messages.pofile import read_po

from galley.server.templates import translated_templates
from galley.translations import FOLDER, KEYWORDS, Catalogues, Translator, language_name, mark
from tests.frontend.pages import FRONTEND, SAID_ALOUD, Page, variants

ROOT = Path(__file__).parents[2]
PLACES = re.compile(r"%\(\w+\)s|\{\w+\}|</?\w+>")
LANGUAGES = sorted(path.parts[-3] for path in FOLDER.glob("*/LC_MESSAGES/galley.po"))
OPENED, CLOSED = "\N{LEFT WHITE SQUARE BRACKET}", "\N{RIGHT WHITE SQUARE BRACKET}"


def _sources() -> Iterator[tuple[str, Path]]:
    for package in ("server", "study"):
        files = (ROOT / "backend/galley" / package).rglob("*.py")
        yield from (("python", path) for path in sorted(files) if "admin" not in path.parts)
    yield from (("jinja2", path) for path in sorted((FRONTEND / "templates").glob("*.html")))


def _messages() -> dict[str, tuple[str, ...]]:
    """Every message in code and templates with its forms, by the first of them."""
    found: dict[str, tuple[str, ...]] = {}
    for method, path in _sources():
        options = {"trimmed": "true"} if method == "jinja2" else {}
        for _, message, _, _ in extract_from_file(method, path, keywords=dict(KEYWORDS), options=options):
            forms = (message,) if isinstance(message, str) else tuple(message)
            found[forms[0]] = forms
    return found


MESSAGES = _messages()


def test_messages_are_found_in_templates_and_code() -> None:
    assert {"Begin", "Time is up!", "Please choose one answer.", "Round {n} of {of}"} <= set(MESSAGES)


def test_d4_five_languages_are_shipped_beside_english() -> None:
    assert LANGUAGES == ["de", "es", "fr", "ja", "zh"]


@pytest.mark.parametrize("language", LANGUAGES)
def test_d4_every_message_is_translated_with_the_same_places(language: str) -> None:
    with (FOLDER / language / "LC_MESSAGES/galley.po").open("rb") as file:
        catalogue = read_po(file)
    said = {message.id if isinstance(message.id, str) else message.id[0]: message for message in catalogue}
    assert [name for name in MESSAGES if name not in said] == []
    assert [name for name in said if name and name not in MESSAGES] == []
    for name, forms in MESSAGES.items():
        message = said[name]
        assert not message.fuzzy, name
        assert (message.id if len(forms) > 1 else (message.id,)) == forms
        spoken = (message.string,) if isinstance(message.string, str) else message.string
        assert len(spoken) == (catalogue.num_plurals if len(forms) > 1 else 1), name
        for words in spoken:
            assert words.strip(), name
            assert '"' not in words, name
            assert set(PLACES.findall(words)) == set(PLACES.findall(forms[-1])), name


class Marking(Translator):
    """Puts brackets around everything that goes through a catalogue."""

    def __init__(self) -> None:
        self.language = "en"

    def gettext(self, message: str) -> str:
        return f"{OPENED}{message}{CLOSED}"

    def ngettext(self, one: str, many: str, n: int) -> str:
        return self.gettext(one if n == 1 else many)


@pytest.mark.parametrize(("template", "values"), [pytest.param(*page[1:], id=page[0]) for page in variants()])
def test_no_word_reaches_a_participant_past_the_catalogue(template: str, values: dict[str, object]) -> None:
    catalogues = Catalogues([Marking()])
    page = Page(
        translated_templates(str(FRONTEND / "templates"), catalogues).get_template(template).render(**values)
    )
    told = [text for tag, text in page.texts if tag not in ("script", "style")]
    told += [value for _, attrs in page.tags for key, value in attrs.items() if key in SAID_ALOUD]
    assert OPENED in "".join(told) or template == "plain.html"
    # Tags may stand inside a message, and another message too.
    bare, found = "\n".join(told), 1
    while found:
        bare, found = re.subn(f"{OPENED}[^{OPENED}{CLOSED}]*{CLOSED}", "", bare)
    assert [line for line in bare.split("\n") if re.search(r"[^\W\d]", line)] == []


def test_scripts_have_no_words_of_their_own() -> None:
    """Two words or more in quotes are a sentence; what goes to the console is not shown."""
    for path in sorted((FRONTEND / "js").glob("*.js")):
        text = re.sub(r"/\*.*?\*/|//[^\n]*", "", path.read_text(encoding="utf-8"), flags=re.S)
        text = "\n".join(line for line in text.split("\n") if not re.search(r"new Error\(|console\.", line))
        assert re.findall(r"""["'`]([A-Z][a-z']+ [a-z][^"'`]*)["'`]""", text) == [], path.name
        assert not re.findall(r"""(?:title|text|button): ["'`][A-Za-z]|Text\(["'`][A-Za-z]""", text), (
            path.name
        )


def test_a_language_is_found_by_what_browsers_send() -> None:
    catalogues = Catalogues.load()
    assert catalogues.languages == ("en", *(code.replace("_", "-") for code in LANGUAGES))
    for code in ("zh", "zh-CN", "ZH-hans-cn", "zh_TW"):
        assert catalogues.translator(code)("Begin") == "开始"
    for code in ("de", "de-AT", "DE-ch-1996"):
        assert catalogues.translator(code)("Begin") == "Beginnen"
    for code in ("en", "en-GB", "xx", "", "zhh"):
        assert catalogues.translator(code)("Begin") == "Begin"


def test_what_has_no_translation_stays_as_it_is() -> None:
    translator = Catalogues.load().translator("zh")
    assert translator(mark("never said anywhere")) == "never said anywhere"
    assert translator("") == ""
    assert translator.ngettext("one {n}", "many {n}", 2) == "many {n}"


def test_numbers_choose_their_form() -> None:
    english, chinese = (Catalogues.load().translator(code) for code in ("en", "zh"))
    forms = ("You have %(tries)s try.", "You have %(tries)s tries.")
    assert [english.ngettext(*forms, n) for n in (1, 2)] == list(forms)
    assert {chinese.ngettext(*forms, n) for n in (1, 2)} == {"您有 %(tries)s 次机会。"}


def test_languages_are_called_what_they_call_themselves() -> None:
    assert [language_name(code) for code in ("en", "zh", "de", "pt-BR", "xx-yy")] == [
        "English",
        "中文",
        "Deutsch",
        "Português (Brasil)",
        "xx-yy",
    ]


@pytest.mark.parametrize(
    ("language", "none", "one", "many"),
    [
        ("de", "etwa 0 Minuten", "etwa 1 Minute", "etwa 2 Minuten"),
        ("es", "alrededor de 0 minutos", "alrededor de 1 minuto", "alrededor de 2 minutos"),
        ("fr", "environ 0 minute", "environ 1 minute", "environ 2 minutes"),
        ("ja", "約 0 分", "約 1 分", "約 2 分"),
    ],
)
def test_d4_numbers_choose_forms_as_the_language_does(language: str, none: str, one: str, many: str) -> None:
    translator = Catalogues.load().translator(language)
    forms = ("about %(count)s minute", "about %(count)s minutes")
    assert [translator.ngettext(*forms, n) % {"count": n} for n in (0, 1, 2)] == [none, one, many]
