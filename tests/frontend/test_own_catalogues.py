"""Row D4: a workspace's own `locale/LANGUAGE.po`, over the catalogues that are shipped."""

from __future__ import annotations

from pathlib import Path

import pytest

from galley.errors import InvalidFiles
from galley.translations import Catalogues, text_direction, unfinished

HEAD = 'msgid ""\nmsgstr ""\n"Content-Type: text/plain; charset=utf-8\\n"\n'
POLISH = '"Plural-Forms: nplurals=3; plural=(n==1 ? 0 : n%10>=2 && n%10<=4 ? 1 : 2);\\n"\n'
TRIES = 'msgid "You have %(tries)s try."\nmsgid_plural "You have %(tries)s tries."\n'


def own(folder: Path, **files: str) -> Catalogues:
    locale = folder / "locale"
    locale.mkdir(exist_ok=True)
    for name, text in files.items():
        (locale / f"{name}.po").write_text(text, encoding="utf-8")
    return Catalogues.load(locale)


def test_d4_own_messages_stand_over_the_shipped_ones_one_by_one(tmp_path: Path) -> None:
    known = own(tmp_path, de=HEAD + '\nmsgid "Begin"\nmsgstr "Los geht\'s"\n')
    assert known.translator("de")("Begin") == "Los geht's"
    assert known.translator("de")("Continue") == "Weiter"
    assert known.lacking("de") == ()
    assert Catalogues.load().translator("de")("Begin") == "Beginnen"


def test_d4_a_language_is_added_and_what_it_lacks_is_counted(tmp_path: Path) -> None:
    text = HEAD + '\nmsgid "Begin"\nmsgstr "Começar"\n\n#, fuzzy\nmsgid "Finish"\nmsgstr "?"\n'
    text += '\nmsgid "Start"\nmsgstr ""\n'
    known = own(tmp_path, pt_BR=text)
    assert known.languages == ("en", "de", "es", "fr", "ja", "zh", "pt-BR")
    assert known.translator("pt-br")("Begin") == "Começar"
    assert [known.translator("pt-BR")(word) for word in ("Finish", "Start")] == ["Finish", "Start"]
    assert known.translator("pt")("Begin") == "Begin"
    assert set(known.messages) - set(known.lacking("pt-BR")) == {"Begin"}


def test_d4_a_region_takes_the_rest_from_its_language(tmp_path: Path) -> None:
    """A sibling case: `de_AT.po` over `de.po` over what is shipped; English may be reworded too."""
    known = own(
        tmp_path,
        de_AT=HEAD + '\nmsgid "Begin"\nmsgstr "Servus"\n',
        de=HEAD + '\nmsgid "Begin"\nmsgstr "Los"\n\nmsgid "Finish"\nmsgstr "Ende"\n',
        en=HEAD + '\nmsgid "Begin"\nmsgstr "Start now"\n',
    )
    words = ("Begin", "Finish", "Continue")
    assert [known.translator("de-at")(word) for word in words] == ["Servus", "Ende", "Weiter"]
    assert [known.translator("de-CH")(word) for word in words] == ["Los", "Ende", "Weiter"]
    assert [known.translator("en-GB")(word) for word in words] == ["Start now", "Finish", "Continue"]
    assert known.lacking("de-AT") == known.lacking("en-GB") == ()


def test_d4_a_message_without_all_its_plural_forms_is_left_out_and_remarked(tmp_path: Path) -> None:
    """A sibling case: Polish needs three forms."""
    text = (
        HEAD
        + POLISH
        + "\n"
        + TRIES
        + 'msgstr[0] "Masz %(tries)s próbę."\nmsgstr[1] "Masz %(tries)s próby."\n'
    )
    known = own(tmp_path, pl=text)
    assert (
        known.translator("pl")
        .ngettext("You have %(tries)s try.", "You have %(tries)s tries.", 5)
        .startswith("You")
    )
    (remark,) = map(str, known.remarks)
    assert remark.startswith("locale/pl.po:6: message 'You have %(tries)s try.' has 2 of the 3 forms that")
    assert remark.endswith("is left out; write msgstr[0] to msgstr[2], or mend the header Plural-Forms")
    whole = own(tmp_path, pl=text + 'msgstr[2] "Masz %(tries)s prób."\n')
    said = whole.translator("pl")
    assert [said.ngettext("You have %(tries)s try.", "", n) for n in (1, 3, 5)] == [
        "Masz %(tries)s próbę.",
        "Masz %(tries)s próby.",
        "Masz %(tries)s prób.",
    ]


def test_d4_without_a_header_numbers_choose_as_the_language_does(tmp_path: Path) -> None:
    forms = "".join(f'msgstr[{n}] "%(tries)s {n}"\n' for n in range(3))
    said = own(tmp_path, pl=HEAD + "\n" + TRIES + forms).translator("pl")
    assert [said.ngettext("You have %(tries)s try.", "", n) for n in (1, 3, 5)] == [
        f"%(tries)s {n}" for n in range(3)
    ]


def test_d4_messages_that_galley_does_not_have_are_remarked(tmp_path: Path) -> None:
    text = HEAD + '\nmsgid "Begin."\nmsgstr "Los"\n\nmsgctxt "x"\nmsgid "Begin"\nmsgstr "Los"\n\n'
    text += 'msgid "You have %(tries)s try."\nmsgstr "%(tries)s"\n'
    known = own(tmp_path, de=text)
    told = [str(one).removeprefix("locale/de.po:") for one in known.remarks]
    assert told == [
        "5: Galley has no message 'Begin.'; did you mean 'Begin'?",
        "9: message 'Begin' has a msgctxt, which no message of Galley has; remove that line",
        "12: message 'You have %(tries)s try.' is another one in Galley; write it with msgid_plural",
    ]
    assert known.translator("de")("Begin") == "Beginnen"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("\nhello\n", "locale/de.po:5: this is no line of a catalogue; write msgid"),
        ('\nmsgid "Begin\nmsgstr "Los"\n', "locale/de.po:5: this is no line of a catalogue"),
        ('\nmsgid "Begin"\n', "locale/de.po:5: not a catalogue: missing msgstr for msgid 'Begin'"),
        (
            '\nmsgid "Begin"\nmsgstr "Los"\n\nmsgid "Be"\n"gin"\nmsgstr "Auf"\n',
            "locale/de.po:8: message 'Begin' stands here again (first on line 5); keep one of the two",
        ),
        (
            '\nmsgid "Round {n} of {of}"\nmsgstr "Runde {m} von {of}"\n',
            "locale/de.po:5: the translation of 'Round {n} of {of}' lacks {n} and has {m}, which",
        ),
        (
            '\nmsgid "Sound"\nmsgstr "100 % Ton"\n',
            "locale/de.po:5: the translation of 'Sound' has a % that belongs to no place; leave it out",
        ),
        (
            '\nmsgid "Sound"\nmsgstr "<script>Ton</script>"\n',
            "locale/de.po:5: the translation of 'Sound' has </script>, which is not in the English",
        ),
        (
            '\nmsgid "Sound"\nmsgstr "\\"Ton\\""\n',
            "locale/de.po:5: the translation of 'Sound' has a \" that belongs to no place",
        ),
        (
            '"Plural-Forms: nplurals=2; plural=(n==;\\n"\n',
            "locale/de.po:4: its header 'Plural-Forms' cannot be read",
        ),
        (
            '"Plural-Forms: nplurals=x; plural=0;\\n"\n',
            "locale/de.po:4: its header 'Plural-Forms' cannot be read",
        ),
        ('"Language: nowhere!!\\n"\n', "locale/de.po:4: its header 'Language' cannot be read"),
    ],
)
def test_d4_a_broken_catalogue_is_told_with_its_line(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InvalidFiles) as caught:
        own(tmp_path, de=HEAD + text)
    assert told in str(caught.value)


def test_d4_names_and_bytes_of_catalogues_are_told(tmp_path: Path) -> None:
    folder = tmp_path / "locale"
    folder.mkdir()
    (folder / "de.po").write_bytes(HEAD.encode() + '\nmsgid "Begin"\nmsgstr "für"\n'.encode("latin-1"))
    with pytest.raises(InvalidFiles) as caught:
        own(tmp_path, German="", pt_BR=HEAD, **{"pt-BR": HEAD})
    assert str(caught.value).split("\n") == [
        "locale/German.po: 'German' is no code of a language; rename it to one such as de.po or pt-BR.po",
        "locale/de.po:6: the text is not UTF-8; save the file as UTF-8",
        "locale/pt_BR.po: there is another catalogue for 'pt-BR'; make one file of both",
    ]


def test_d4_languages_are_written_from_the_side_they_are_written_from() -> None:
    """A sibling case: Arabic and Hebrew begin on the right."""
    assert [text_direction(code) for code in ("ar", "he-IL", "fa", "de", "zh-Hant", "xx-yy")] == [
        *("rtl", "rtl", "rtl"),
        *("ltr", "ltr", "ltr"),
    ]


def test_d4_a_catalogue_to_fill_in_holds_every_message_once(tmp_path: Path) -> None:
    known = own(tmp_path)
    text, count = unfinished("pl", known)
    assert count == len(known.messages)
    assert text.count('msgstr[2] ""') == sum(len(forms) > 1 for forms in known.messages.values())
    filled = text.replace('msgid "Begin"\nmsgstr ""', 'msgid "Begin"\nmsgstr "Zaczynamy"')
    again = own(tmp_path, pl=filled)
    assert again.translator("pl")("Begin") == "Zaczynamy"
    assert again.remarks == ()
    assert len(again.lacking("pl")) == count - 1
    assert unfinished("pl", again, filled) == (filled, 0)
    assert unfinished("de", known)[1] == 0
