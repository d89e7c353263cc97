"""Row D4: what participants would not read in the language they chose is named, per study and language."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from galley.errors import InvalidFiles
from galley.files.reading import read
from galley.study.language_remarks import language_remarks
from galley.study.remarks import study_remarks
from galley.study.study import load_study
from galley.study.written.questionnaire import load_questionnaire
from galley.translations import Catalogues
from galley.workspace import Workspace
from tests.study.workspaces import ROOT, study_workspace

STUDY = """\
format: 1
title: {en: Cook, de: Kochen}
about: Make soup
languages: [en, de]
seed: 3
completion: {code: DONE}
stages:
  - {kind: consent, text: words}
  - {kind: questionnaire, questionnaire: asked}
  - {kind: questionnaire, questionnaire: nasa-tlx}
  - {kind: rounds, title: 1, agents: [random], layouts: [{layout: cramped_room}]}
  - {kind: debrief, text: words}
""".replace("title: 1,", 'title: "1",')
ASKED = """\
format: 1
title: {en: Questions, de: Fragen}
source: made up
items:
  - id: liked
    kind: likert
    text: {en: Did you like it?, de: Hat es Ihnen gefallen?}
    scale: 3
    labels: [no, {en: "so, so", de: mittel}, "yes"]
    low_label: low
    high_label: {en: high, de: hoch}
  - {id: age, kind: number, min: 1, max: 99, text: "?", unit: years}
"""


def workspace(
    folder: Path, study: str = STUDY, *, texts: tuple[str, ...] = ("words", "words.de")
) -> Workspace:
    made = study_workspace(folder / "w", study)
    (made.path / "questionnaires" / "asked.yaml").write_text(
        ASKED.replace("[no,", '["no",'), encoding="utf-8"
    )
    for name in texts:
        (made.folder("texts") / f"{name}.md").write_text("# 1\n\n1", encoding="utf-8")
    return made


def told(place: Workspace, study: str = "mine") -> list[str]:
    document = read(place.find("studies", study), f"studies/{study}.yaml")
    return [str(remark) for remark in language_remarks(place, load_study(place, study), document)]


def test_d4_every_word_that_is_given_once_is_named(tmp_path: Path) -> None:
    remarks = told(workspace(tmp_path))
    assert [remark.removesuffix("; write {en: ..., de: ...}") for remark in remarks[:5]] == [
        "studies/mine.yaml:3: 'about' is not in 'de', so 'Make soup' is shown",
        "questionnaires/asked.yaml:9: 'labels' is not in 'de', so 'no' is shown",
        "questionnaires/asked.yaml:9: 'labels' is not in 'de', so 'yes' is shown",
        "questionnaires/asked.yaml:10: 'low_label' is not in 'de', so 'low' is shown",
        "questionnaires/asked.yaml:12: 'unit' is not in 'de', so 'years' is shown",
    ]
    (scale,) = remarks[5:]
    assert scale.startswith(
        "questionnaires/nasa-tlx.yaml:2: none of its 26 texts is in 'de': they are shown as"
    )
    assert "Published in German" in scale


def test_d4_a_study_whole_in_its_languages_is_remarked_on_for_nothing(tmp_path: Path) -> None:
    place = workspace(tmp_path, STUDY.replace("about: Make soup\n", "").replace("nasa-tlx", "asked"))
    (place.path / "questionnaires" / "asked.yaml").write_text(
        ASKED.replace("[no,", "[{en: 'no', de: nein},")
        .replace('"yes"]', '{en: "yes", de: ja}]')
        .replace("low_label: low", "low_label: {en: low, de: niedrig}")
        .replace("unit: years", "unit: {en: years, de: Jahre}"),
        encoding="utf-8",
    )
    assert told(place) == []
    assert list(study_remarks(place, load_study(place, "mine"))) == []


def test_d4_words_given_once_in_the_one_language_of_a_study_are_taken_for_its_own(tmp_path: Path) -> None:
    """A sibling case: a study in Austrian German alone, with a ready questionnaire that is in English."""
    study = STUDY.replace("{en: Cook, de: Kochen}", "Kochen").replace("[en, de]", "[de-AT]")
    study = study.replace("questionnaire: asked", "questionnaire: nasa-tlx")
    remarks = told(workspace(tmp_path, study))
    assert len(remarks) == 1
    assert remarks[0].startswith("questionnaires/nasa-tlx.yaml:2: none of its 26 texts is in 'de-AT'")


def test_d4_a_language_without_a_catalogue_is_told_with_what_to_do(tmp_path: Path) -> None:
    place = workspace(
        tmp_path, STUDY.replace("[en, de]", "[de, it]").replace("en:", "it:"), texts=("words", "words.it")
    )
    ask = place.path / "questionnaires" / "asked.yaml"
    ask.write_text(ask.read_text(encoding="utf-8").replace("en:", "it:"), encoding="utf-8")
    first = told(place)[0]
    assert first.startswith(
        "studies/mine.yaml:4: there is no catalogue for 'it': buttons and errors are shown in "
    )
    assert first.endswith(
        "; `galley studies catalogue it` writes what is to be translated, see docs/translations.md"
    )
    own = place.folder("catalogues")
    own.mkdir()
    head = 'msgid ""\nmsgstr "Content-Type: text/plain; charset=utf-8\\n"\n\n'
    (own / "it.po").write_text(
        head + 'msgid "Something went wrong"\nmsgstr "Qualcosa"\n\nmsgid "x"\nmsgstr "y"\n'
    )
    remarks = told(place)
    assert remarks[0].startswith("locale/it.po:7: Galley has no message 'x'")
    assert "messages of buttons and errors are not in 'it': 'Not possible', " in remarks[1]
    assert " more; `galley studies catalogue it`" in remarks[1]


def test_d4_a_text_of_galley_s_in_english_is_told_in_a_german_study(tmp_path: Path) -> None:
    """A sibling case: `texts/NAME.md` stands for the first language, whatever it is written in."""
    study = (
        STUDY.replace("{en: Cook, de: Kochen}", "Kochen")
        .replace("[en, de]", "[de]")
        .replace("words", "consent")
    )
    place = workspace(tmp_path, study.replace("nasa-tlx", "asked"), texts=())
    assert told(place)[-1] == (
        "questionnaires/texts/consent.md:1: this is the English text that Galley brings, shown in 'de'; "
        "write questionnaires/texts/consent.de.md"
    )


def test_d4_all_that_lacks_is_a_problem_at_once(tmp_path: Path) -> None:
    """The study's own words, a questionnaire's and a text: none hides the others; every language."""
    study = STUDY.replace("[en, de]", "[en, de, fr]").replace(
        "title: {en: Cook, de: Kochen}", "title: {en: Cook}"
    )
    place = workspace(tmp_path, study, texts=("words",))
    with pytest.raises(InvalidFiles) as caught:
        load_study(place, "mine")
    problems = [str(problem) for problem in caught.value.problems]
    for language in ("de", "fr"):
        assert any(f"studies/mine.yaml:2: there are no words in '{language}'" in one for one in problems)
        assert any(f"text 'words' is not there in '{language}'" in one for one in problems)
    assert any("questionnaires/asked.yaml:2: there are no words in 'fr'" in one for one in problems)


def test_d4_a_broken_catalogue_is_a_problem_of_the_study_and_folders_are_told(tmp_path: Path) -> None:
    from galley.study.check import check_study, check_workspace

    place = workspace(tmp_path)
    folder = place.folder("catalogues")
    (folder / "fr" / "LC_MESSAGES").mkdir(parents=True)
    shutil.copy(ROOT / "backend/galley/locale/fr/LC_MESSAGES/galley.po", folder / "fr" / "LC_MESSAGES")
    (folder / "de.po").write_text("hello\n", encoding="utf-8")
    broken = "locale/de.po:1: this is no line of a catalogue"
    assert [str(one).startswith(broken) for one in check_study(place, "mine")] == [True]
    problems = [str(one) for one in check_workspace(place)]
    assert "locale/fr: catalogues in folders of their own are not read; move it to locale/fr.po" in problems
    assert any(one.startswith(broken) for one in problems)


def test_d4_a_catalogue_of_a_study_s_language_is_part_of_its_hash(tmp_path: Path) -> None:
    place = workspace(tmp_path)
    before = load_study(place, "mine").sha256
    place.folder("catalogues").mkdir()
    text = 'msgid ""\nmsgstr "Content-Type: text/plain; charset=utf-8\\n"\n\nmsgid "Begin"\nmsgstr "Los"\n'
    (place.folder("catalogues") / "fr.po").write_text(text, encoding="utf-8")
    assert load_study(place, "mine").sha256 == before
    (place.folder("catalogues") / "de_CH.po").write_text(text, encoding="utf-8")
    assert load_study(place, "mine").sha256 != before


def test_d4_ready_questionnaires_say_why_they_are_not_in_a_language(tmp_path: Path) -> None:
    place = workspace(tmp_path, STUDY.replace("nasa-tlx", "after-round"))
    with pytest.raises(InvalidFiles) as caught:
        load_study(place, "mine")
    problems = [str(problem) for problem in caught.value.problems]
    assert any(
        "11 of its texts are not in 'de': Beside the Chinese by the project we can name" in one
        for one in problems
    )


@pytest.mark.parametrize("path", sorted((ROOT / "questionnaires").glob("*.yaml")), ids=lambda path: path.stem)
def test_d4_ready_questionnaires_are_in_every_shipped_language_or_tell_why_not(path: Path) -> None:
    every = {"language": "de", "languages": Catalogues.load().languages}
    try:
        asked = load_questionnaire(path, context=every).value
    except InvalidFiles:
        asked = load_questionnaire(path).value
        assert asked.translations
        return
    assert (asked.language == "en") == bool(asked.translations)
    if not asked.translations:
        assert {"de", "en", "es", "fr", "ja", "zh"} <= set(read(path).data["title"])
