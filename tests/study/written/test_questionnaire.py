from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.errors import InvalidFiles
from galley.study.written.questionnaire import (
    Questionnaire,
    asked,
    failed_checks,
    load_questionnaire,
    validate_answers,
)
from tests.study.workspaces import ROOT

SCALE = {"text": "?", "low_label": "no", "high_label": "yes"}
OPTIONS = [{"value": "yes", "label": "Yes"}, {"value": "no", "label": "No"}]


def made(*items: dict[str, Any]) -> Questionnaire:
    """A questionnaire of the given items; ids and texts are filled in."""
    full = [{"id": f"q{n}", "text": "?", **item} for n, item in enumerate(items)]
    text = json.dumps({"format": 1, "title": "T", "source": "S", "items": full})
    return Questionnaire.model_validate_json(text, strict=True)


def answer(item: dict[str, Any], *values: str) -> tuple[Any, str | None]:
    answers, problems = validate_answers(made(item), {"q0": values})
    return answers["q0"], problems.get("q0")


@pytest.mark.parametrize(
    ("item", "values", "wanted"),
    [
        ({"kind": "likert", **SCALE}, ["1"], 1),
        ({"kind": "likert", **SCALE}, ["7"], 7),
        ({"kind": "likert", **SCALE, "scale": 11}, ["11"], 11),
        ({"kind": "comparison", **SCALE}, ["4"], 4),
        ({"kind": "single_choice", "options": OPTIONS}, ["no"], "no"),
        ({"kind": "multiple_choice", "options": OPTIONS}, ["no", "yes", "no"], ["yes", "no"]),
        ({"kind": "number", "min": 16, "max": 120}, [" 16 "], 16),
        ({"kind": "number", "min": -5, "max": 5}, ["-3"], -3),
        ({"kind": "number", "min": 0, "max": 5, "whole": False}, ["2,5"], 2.5),
        ({"kind": "short_text"}, ["  two\r\nlines\x00 "], "two lines"),
        ({"kind": "long_text"}, ["  one\r\ntwo\rthree\t\x07 "], "one\ntwo\nthree"),
        ({"kind": "short_text", "max_length": 3}, ["<b>"], "<b>"),
        ({"kind": "long_text", "required": False}, ["  "], None),
        ({"kind": "likert", **SCALE, "required": False}, [], None),
        ({"kind": "multiple_choice", "options": OPTIONS, "required": False}, [], None),
    ],
)
def test_good_answers_are_stored_as_what_they_are(
    item: dict[str, Any], values: list[str], wanted: Any
) -> None:
    got, problem = answer(item, *values)
    assert problem is None
    assert got == wanted
    assert type(got) is type(wanted)


@pytest.mark.parametrize(
    ("item", "values"),
    [
        ({"kind": "likert", **SCALE}, []),
        ({"kind": "likert", **SCALE}, [""]),
        ({"kind": "likert", **SCALE}, ["0"]),
        ({"kind": "likert", **SCALE}, ["8"]),
        ({"kind": "likert", **SCALE}, ["3.5"]),
        ({"kind": "likert", **SCALE}, ["07"]),
        ({"kind": "likert", **SCALE}, ["３"]),
        ({"kind": "likert", **SCALE}, ["3", "4"]),
        ({"kind": "comparison", **SCALE}, ["-1"]),
        ({"kind": "single_choice", "options": OPTIONS}, ["maybe"]),
        ({"kind": "single_choice", "options": OPTIONS}, ["yes", "no"]),
        ({"kind": "multiple_choice", "options": OPTIONS}, ["yes", "maybe"]),
        ({"kind": "multiple_choice", "options": OPTIONS}, []),
        ({"kind": "number", "min": 16, "max": 120}, ["15"]),
        ({"kind": "number", "min": 16, "max": 120}, ["121"]),
        ({"kind": "number", "min": 16, "max": 120}, ["20.5"]),
        ({"kind": "number", "min": 16, "max": 120}, ["old"]),
        ({"kind": "number", "min": 16, "max": 120}, ["9" * 5000]),
        ({"kind": "number", "min": 0, "max": 5, "whole": False}, ["nan"]),
        ({"kind": "number", "min": 0, "max": 5, "whole": False}, ["1e400"]),
        ({"kind": "short_text", "max_length": 3}, ["four"]),
        ({"kind": "short_text"}, [" \x00\n "]),
        ({"kind": "long_text"}, ["x" * 5001]),
    ],
)
def test_answers_that_do_not_fit_are_refused_and_never_stored(
    item: dict[str, Any], values: list[str]
) -> None:
    got, problem = answer(item, *values)
    assert got is None
    assert problem
    assert problem.startswith("Please ")


LEVEL = (
    {"id": "played", "kind": "single_choice", "options": OPTIONS},
    {"id": "level", "kind": "short_text", "when": {"item": "played", "any_of": ["yes"]}},
)


def test_a_conditional_item_is_required_only_where_it_is_asked() -> None:
    questionnaire = made(*LEVEL)
    assert validate_answers(questionnaire, {"played": ["no"]}) == ({"played": "no", "level": None}, {})
    assert set(validate_answers(questionnaire, {"played": ["yes"]})[1]) == {"level"}
    # What was typed before the answer changed to no is not an answer.
    assert validate_answers(questionnaire, {"played": ["no"], "level": ["top"]})[0]["level"] is None
    assert set(validate_answers(questionnaire, {})[1]) == {"played"}


def test_conditions_read_multiple_choices_too() -> None:
    item = made(
        {"kind": "multiple_choice", "options": OPTIONS},
        {"kind": "short_text", "when": {"item": "q0", "any_of": ["no"]}},
    ).items[1]
    assert asked(item, {"q0": ["yes", "no"]})
    assert not asked(item, {"q0": ["yes"]})
    assert not asked(item, {"q0": None})


def test_attention_checks_tell_who_failed_them() -> None:
    questionnaire = made(
        {"kind": "likert", **SCALE, "expected": 2},
        {"kind": "single_choice", "options": OPTIONS, "expected": "no"},
        {"kind": "likert", **SCALE},
    )
    assert failed_checks(questionnaire, {"q0": 2, "q1": "no", "q2": 1}) == ()
    assert failed_checks(questionnaire, {"q0": 3, "q1": "yes", "q2": 1}) == ("q0", "q1")


@given(form=st.dictionaries(st.sampled_from([f"q{n}" for n in range(8)]), st.lists(st.text(), max_size=3)))
def test_no_form_breaks_validation_and_every_item_is_accounted_for(form: dict[str, list[str]]) -> None:
    questionnaire = made(
        {"kind": "likert", **SCALE},
        {"kind": "comparison", **SCALE},
        {"kind": "single_choice", "options": OPTIONS},
        {"kind": "multiple_choice", "options": OPTIONS},
        {"kind": "number", "min": 0, "max": 9},
        {"kind": "number", "min": 0, "max": 9, "whole": False},
        {"kind": "short_text"},
        {"kind": "long_text"},
    )
    answers, problems = validate_answers(questionnaire, form)
    assert list(answers) == [item.id for item in questionnaire.items]
    assert {item for item, value in answers.items() if value is None} == set(problems)
    assert json.loads(json.dumps(answers)) == answers


def test_the_questionnaires_of_the_paper_ask_what_it_asks() -> None:
    """COLE paper, Table 1 and Figs. 14, 18 and 19."""
    read = {path.stem: load_questionnaire(path).value for path in (ROOT / "questionnaires").glob("*.yaml")}
    assert [item.id for item in read["before-game"].items] == ["age", "gender", "played", "level"]
    after, comparison = read["after-round"].items, read["comparison"].items
    assert [(item.kind, item.scale, item.low_label, item.high_label) for item in after] == [
        ("likert", 7, "strongly disagree", "strongly agree")
    ] * 3
    assert [(item.kind, item.scale, len(item.labels)) for item in comparison] == [("comparison", 7, 7)] * 3
    assert comparison[0].labels[0] == "strongly prefer the first"
    assert comparison[0].labels[3] == "no preference"
    of_the_paper = ("before-game", "after-round", "comparison")
    assert all("COLE paper" in read[name].source for name in of_the_paper)
    assert all("Hoffman (2019)" in read[name].source for name in ("after-round", "comparison"))


def test_a_bad_questionnaire_is_told_in_full(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text("""\
format: 1
title: Bad
source: none
items:
  - {id: a, kind: likert, text: A, scale: 1, low_label: l, high_label: h}
  - {id: b, kind: likert, text: B, low_label: l, high_label: h, labels: [x], style: sliders}
  - {id: Bad Id, kind: short_text, text: C}
  - {id: d, kind: single_choice, text: D, options: [{value: x, label: X}]}
  - {id: e, kind: gauge, text: E}
  - {id: f, kind: number, text: F, min: 5, max: 1}
  - id: g
    kind: multiple_choice
    text: G
    options: [{value: x, label: X}, {value: x, label: Y}]
  - {id: h, kind: likert, text: H, low_label: l, high_label: h, labels: [x]}
  - {id: i, kind: likert, text: I, low_label: l, high_label: h, expected: 9}
""")
    with pytest.raises(InvalidFiles) as caught:
        load_questionnaire(path, "bad.yaml")
    assert str(caught.value).splitlines() == [
        "bad.yaml:5: 'items' no. 1, 'scale' 1 is out of range; it must be at least 2",
        "bad.yaml:6: 'items' no. 2, 'style' 'sliders' is unknown; use one of 'radio', 'stars'",
        (
            "bad.yaml:7: 'items' no. 3, 'id' 'Bad Id' has a form that is not allowed; "
            "it must match ^[a-z][a-z0-9_]*$"
        ),
        "bad.yaml:8: 'items' no. 4, 'options' is too short; it needs at least 2",
        (
            "bad.yaml:9: kind 'gauge' is unknown in 'items' no. 5; use one of comparison likert long_text "
            "multiple_choice number ranking semantic_differential short_text single_choice slider"
        ),
        "bad.yaml:10: 'min' 5 is above 'max' 1; exchange them",
        "bad.yaml:14: option 'x' stands twice; give each option its own value",
        "bad.yaml:15: 1 labels for a scale of 7; write 7 labels, or none",
        "bad.yaml:16: 9 is not on the scale; use 1 to 7",
    ]


def test_items_must_fit_together(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text("""\
format: 1
title: Bad
source: none
items:
  - {id: step, kind: short_text, text: A}
  - {id: twice, kind: short_text, text: B, when: {item: later, any_of: [x]}}
  - {id: twice, kind: short_text, text: C}
  - {id: later, kind: single_choice, text: D, options: [{value: x, label: X}, {value: y, label: Y}]}
  - {id: last, kind: short_text, text: E, when: {item: later, any_of: [y, z]}}
""")
    with pytest.raises(InvalidFiles) as caught:
        load_questionnaire(path, "bad.yaml")
    assert str(caught.value).splitlines() == [
        "bad.yaml:5: item id 'step' is taken by the page; choose another id",
        (
            "bad.yaml:6: 'when' asks for 'later', which is no choice item above this one; "
            "use one of single_choice items that stand above"
        ),
        "bad.yaml:7: item id 'twice' stands twice; give each item its own id",
        "bad.yaml:9: 'z' is no option of 'later'; use one of x y",
    ]
