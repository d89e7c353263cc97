from __future__ import annotations

from pathlib import Path

import pytest

from galley.errors import InvalidFiles
from galley.study.study import Study, load_study
from galley.study.visit.plan import plan_visit
from galley.study.written.languages import choose_language
from galley.study.written.questionnaire import validate_answers
from galley.workspace import Workspace
from tests.study.workspaces import study_workspace

STUDY = """\
format: 1
title: {en: Cook, zh: 做饭}
about: 42
languages: [en, zh]
seed: 3
completion: {code: DONE}
stages:
  - {kind: consent, text: words}
  - {kind: questionnaire, questionnaire: asked}
  - kind: rounds
    title: {en: A round, zh: 一局}
    agents: [random]
    goal_text: {en: "Reach {goal}.", zh: "达到 {goal} 分。"}
    layouts: [{layout: cramped_room, goal: 20}]
  - {kind: debrief, text: words}
""".replace("about: 42\n", "")
ASKED = """\
format: 1
title: {en: Questions, zh: 问题}
source: made up
items:
  - id: liked
    kind: single_choice
    text: {en: Did you like it?, zh: 你喜欢吗？}
    options:
      - {value: "yes", label: {en: "Yes", zh: 是}}
      - {value: "no", label: {en: "No", zh: 否}}
  - {id: same, kind: short_text, text: OK?, required: false}
"""


def bilingual(folder: Path, study: str = STUDY, asked: str = ASKED, *, zh: bool = True) -> Workspace:
    workspace = study_workspace(folder, study)
    (workspace.path / "questionnaires" / "asked.yaml").write_text(asked, encoding="utf-8")
    texts = workspace.path / "questionnaires" / "texts"
    (texts / "words.md").write_text("# Words\n\n{minutes} minutes", encoding="utf-8")
    if zh:
        (texts / "words.zh.md").write_text("# 文字\n\n{minutes} 分钟", encoding="utf-8")
    return workspace


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return load_study(bilingual(tmp_path / "w"), "mine")


def test_a_study_speaks_each_of_its_languages(study: Study) -> None:
    zh = study.in_language("zh")
    assert (study.language, zh.language, study.languages) == ("en", "zh", ("en", "zh"))
    assert (study.title, zh.title) == ("Cook", "做饭")
    assert (study.texts["words"].title, zh.texts["words"].title) == ("Words", "文字")
    assert study.texts["words"].sha256 != zh.texts["words"].sha256
    assert [item.text for item in zh.questionnaires["asked"].items] == ["你喜欢吗？", "OK?"]
    assert zh.questionnaires["asked"].items[0].options[1].label == "否"
    assert study.sha256 == zh.sha256
    assert study.in_language("fr") is study
    assert zh.in_language("en") is study


def test_the_plan_differs_in_words_only(study: Study) -> None:
    en = plan_visit(study, 5, 0)
    zh = plan_visit(study.in_language("zh"), 5, 0, say={"Round {n} of {of}": "第 {n} 局"}.get)  # type: ignore[arg-type]
    assert (en.language, zh.language) == ("en", "zh")
    assert [step.id for step in en.steps] == [step.id for step in zh.steps]
    assert (en.steps[2].title, zh.steps[2].title) == ("A round", "一局")
    assert zh.steps[2].goal.text == "达到 20 分。"
    assert en.steps[2].seed == zh.steps[2].seed


def test_messages_go_through_gettext(study: Study) -> None:
    told = {"Please choose one answer.": "请选择一个答案。"}
    _, problems = validate_answers(study.questionnaires["asked"], {}, lambda text: told.get(text, text))
    assert problems == {"liked": "请选择一个答案。"}


def test_titles_of_rounds_go_through_gettext(tmp_path: Path) -> None:
    plain = STUDY.replace("    title: {en: A round, zh: 一局}\n", "").replace(
        '    goal_text: {en: "Reach {goal}.", zh: "达到 {goal} 分。"}\n', ""
    )
    study = load_study(bilingual(tmp_path / "w", plain), "mine")
    say = {
        "Round {n} of {of}": "第 {n} 局，共 {of} 局",
        "Reach {goal} points together to meet this kitchen's goal.": "一起达到 {goal} 分。",
    }
    step = plan_visit(study.in_language("zh"), 5, 0, say=lambda text: say.get(text, text)).steps[2]
    assert step.title == "第 1 局，共 1 局"
    assert step.goal.text == "一起达到 20 分。"


@pytest.mark.parametrize(
    ("study", "asked", "zh", "told"),
    [
        (
            STUDY.replace("{en: Cook, zh: 做饭}", "{en: Cook}"),
            ASKED,
            True,
            "studies/mine.yaml:2: there are no words in 'zh'; add `zh: ...`",
        ),
        (
            STUDY,
            ASKED.replace('label: {en: "No", zh: 否}', 'label: {en: "No"}'),
            True,
            "questionnaires/asked.yaml:10: there are no words in 'zh'",
        ),
        (
            STUDY,
            ASKED,
            False,
            "studies/mine.yaml:3: text 'words' is not there in 'zh'; write questionnaires/texts/words.zh.md",
        ),
        (STUDY.replace("zh: 做饭", "Chinese: 做饭"), ASKED, True, "'Chinese' is no code of a language"),
        (STUDY.replace("zh: 做饭", "zh: ''"), ASKED, True, "the words in 'zh' must be text, and not empty"),
        (STUDY.replace("[en, zh]", "[en, en]"), ASKED, True, "language 'en' stands twice"),
        (
            STUDY.replace("[en, zh]", "[English]"),
            ASKED,
            True,
            "'languages' no. 1 'English' has a form that is not allowed",
        ),
    ],
)
def test_missing_words_are_told(tmp_path: Path, study: str, asked: str, zh: bool, told: str) -> None:
    with pytest.raises(InvalidFiles) as caught:
        load_study(bilingual(tmp_path / "w", study, asked, zh=zh), "mine")
    assert any(told in str(problem) for problem in caught.value.problems), caught.value


@pytest.mark.parametrize(
    ("accepted", "wanted"),
    [
        (None, "en"),
        ("", "en"),
        ("zh", "zh"),
        ("zh-CN,zh;q=0.9,en;q=0.8", "zh"),
        ("fr, en;q=0.3, zh;q=0.7", "zh"),
        ("EN-gb", "en"),
        ("fr-FR,de", "en"),
        ("zh;q=0,en;q=0.1", "en"),
        ("zh;q=x, pt", "pt-BR"),
        (",,;;q=1,zh" * 100, "zh"),
        ("*", "en"),
        ("pt-PT", "pt-BR"),
        ("pt-PT;q=0.9,zh;q=0.8", "pt-BR"),
        ("-", "en"),
    ],
)
def test_the_browser_s_language_is_chosen_if_it_is_offered(accepted: str | None, wanted: str) -> None:
    assert choose_language(("en", "zh", "pt-BR"), accepted) == wanted


@pytest.mark.parametrize(
    ("accepted", "wanted"),
    [
        ("de-AT", "de-AT"),
        ("de-CH", "de"),
        ("de", "de"),
        ("de-AT-1996", "de-AT"),
        ("nl;q=0.5,de-at;q=0.4", "de-AT"),
    ],
)
def test_d4_the_closest_of_a_language_s_regions_is_chosen(accepted: str, wanted: str) -> None:
    """A sibling case: a study in German and in Austrian German."""
    assert choose_language(("en", "de", "de-AT"), accepted) == wanted
