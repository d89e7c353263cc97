"""The kinds of items that phase one had not: sliders, rankings, opposites, orders, scores."""

from __future__ import annotations

from typing import Any, get_args
from urllib.parse import urlencode

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from galley.study.scores import subscale_scores, wrong_items
from galley.study.visit.draft import item_order
from galley.study.written.item_base import BaseItem
from galley.study.written.items import Item, Number, stored_item
from galley.study.written.questionnaire import load_questionnaire, validate_answers
from tests.study.workspaces import ROOT
from tests.study.written.test_questionnaire import OPTIONS, SCALE, made

THREE = [{"value": value, "label": value.upper()} for value in ("a", "b", "c")]
SLIDER = {"kind": "slider", "low_label": "no", "high_label": "yes"}


def answer(item: dict[str, Any], form: dict[str, list[str]]) -> tuple[Any, str | None]:
    answers, problems = validate_answers(made(item), form)
    return answers["q0"], problems.get("q0")


@pytest.mark.parametrize(
    ("item", "given", "wanted"),
    [
        (SLIDER, "0", 0),
        (SLIDER, "100", 100),
        ({**SLIDER, "step": 5}, "35", 35),
        ({**SLIDER, "min": -1, "max": 1, "step": 0.1}, "-0.3", -0.3),
        ({**SLIDER, "min": 0, "max": 1, "step": 0.25}, "0,75", 0.75),
        ({"kind": "semantic_differential", **SCALE, "scale": 5}, "5", 5),
        ({"kind": "likert", **SCALE, "scale": 21}, "21", 21),
    ],
)
def test_points_are_stored_as_numbers(item: dict[str, Any], given: str, wanted: object) -> None:
    assert answer(item, {"q0": [given]}) == (wanted, None)


@pytest.mark.parametrize("kind", ["likert", "semantic_differential", "comparison"])
@pytest.mark.parametrize(("start", "scale"), [(0, 11), (-3, 7), (1, 7), (10, 2)])
def test_f24_a_scale_begins_where_its_file_says(kind: str, start: int, scale: int) -> None:
    item = {
        "kind": kind,
        **SCALE,
        "scale": scale,
        "start": start,
        "labels": ["word"] * (scale - 1) + ["last"],
    }
    last = start + scale - 1
    one = made(item).items[0]
    assert [answer(item, {"q0": [str(point)]})[0] for point in (start, last)] == [start, last]
    for beside in (start - 1, last + 1, "", "1.0", f"+{last}"):
        assert answer(item, {"q0": [str(beside)]})[0] is None
    assert answer(item, {"q0": ["999"]})[1] == f"Please choose a point from {start} to {last}."
    assert one.label_of(last) == "last"
    if kind == "comparison":
        assert [one.preference(point) for point in (start, last)] == [(1 - scale) / 2, (scale - 1) / 2]
    else:
        back = made({**item, "reversed": True, "subscale": "s"}).items[0]
        assert [back.scored(point) for point in (start, last)] == [last, start]


def test_f24_an_expected_point_lies_on_the_scale() -> None:
    zero = {"kind": "likert", **SCALE, "scale": 11, "start": 0}
    assert made({**zero, "expected": 0}).items[0].passed(0) is True
    with pytest.raises(ValidationError, match="11 is not on the scale"):
        made({**zero, "expected": 11})


ASTRAL, LINES = "\N{GRINNING FACE}", "\r\n"
MANY = [{"value": f"{'v' * 36}{n:02}", "label": "?"} for n in range(50)]


@pytest.mark.parametrize(
    ("item", "sent"),
    [
        ({"kind": "long_text", "max_length": 20000}, [("q0", "\N{CJK UNIFIED IDEOGRAPH-4E00}" * 20000)]),
        ({"kind": "long_text", "max_length": 20000}, [("q0", ASTRAL * 10000)]),  # maxlength counts halves
        ({"kind": "long_text", "max_length": 1000}, [("q0", LINES * 500)]),
        ({"kind": "short_text"}, [("q0", "\N{LATIN SMALL LETTER E WITH ACUTE}" * 200)]),
        ({"kind": "multiple_choice", "options": MANY}, [("q0", one["value"]) for one in MANY]),
        ({"kind": "ranking", "options": MANY[:20]}, [(f"q0.{one['value']}", "20") for one in MANY[:20]]),
        ({"kind": "number", "min": 0, "max": 1}, [("q0", "1" * 20)]),
    ],
)
def test_f14_a_questionnaire_knows_its_largest_form(
    item: dict[str, Any], sent: list[tuple[str, str]]
) -> None:
    most, fields = made(item).form_size
    assert len(urlencode(sent)) <= most
    assert len(sent) <= fields


@pytest.mark.parametrize(
    ("item", "given"),
    [
        (SLIDER, ""),
        (SLIDER, "101"),
        (SLIDER, "-1"),
        (SLIDER, "50.5"),
        (SLIDER, "half"),
        (SLIDER, "1e2"),
        ({**SLIDER, "step": 5}, "36"),
        ({"kind": "semantic_differential", **SCALE, "scale": 5}, "6"),
    ],
)
def test_untouched_sliders_and_points_beside_the_line_are_refused(item: dict[str, Any], given: str) -> None:
    value, problem = answer(item, {"q0": [given]})
    assert value is None
    assert problem
    assert problem.startswith("Please ")
    assert answer(item, {})[1]


def test_a_slider_that_need_not_be_answered_stores_nothing_untouched() -> None:
    assert answer({**SLIDER, "required": False}, {"q0": [""]}) == (None, None)


def ranked(**places: str) -> dict[str, list[str]]:
    return {f"q0.{value}": [place] for value, place in places.items()}


RANKING = {"kind": "ranking", "options": THREE}


def test_a_ranking_is_stored_with_the_first_place_first() -> None:
    assert answer(RANKING, ranked(a="2", b="3", c="1")) == (["c", "a", "b"], None)


@pytest.mark.parametrize(
    "form",
    [
        {},
        ranked(a="1", b="2"),
        ranked(a="1", b="2", c=""),
        ranked(a="1", b="1", c="2"),
        ranked(a="0", b="1", c="2"),
        ranked(a="1", b="2", c="4"),
        {**ranked(a="1", b="2"), "q0.c": ["3", "3"]},
    ],
)
def test_a_ranking_needs_every_place_once(form: dict[str, list[str]]) -> None:
    value, problem = answer(RANKING, form)
    assert value is None
    assert problem


def test_a_ranking_may_be_left_out_whole_but_not_in_part() -> None:
    item = {**RANKING, "required": False}
    assert answer(item, {}) == (None, None)
    assert answer(item, ranked(a="1"))[1]


@given(places=st.permutations(["1", "2", "3"]))
def test_any_complete_ranking_is_an_answer(places: list[str]) -> None:
    value, problem = answer(RANKING, ranked(**dict(zip("abc", places, strict=True))))
    assert problem is None
    assert [places["abc".index(option)] for option in value] == ["1", "2", "3"]


def test_wrong_answers_of_a_quiz_come_with_their_hints() -> None:
    quiz = made(
        {"kind": "number", "min": 0, "max": 9, "expected": 3, "hint": "Look again."},
        {"kind": "multiple_choice", "options": THREE, "expected": ["a", "c"]},
        {"kind": "slider", **{k: SLIDER[k] for k in ("low_label", "high_label")}, "expected": 50},
        {"kind": "single_choice", "options": OPTIONS, "expected": "yes"},
    )
    right = {"q0": 3, "q1": ["c", "a"], "q2": 50, "q3": "yes"}
    assert wrong_items(quiz, right) == {}
    assert wrong_items(quiz, {**right, "q0": 4, "q1": ["a"]}) == {"q0": "Look again.", "q1": ""}
    assert quiz.expected == {"q0": 3.0, "q1": ["a", "c"], "q2": 50.0, "q3": "yes"}


def test_preferences_are_signed_from_the_middle_of_the_scale() -> None:
    item = made({"kind": "comparison", **SCALE}).items[0]
    assert [item.preference(point) for point in (1, 4, 7)] == [-3, 0, 3]
    assert item.preference(None) is None


def test_numbers_are_told_with_all_their_digits() -> None:
    wide = {"kind": "number", "min": 0, "max": 1234567}
    assert answer(wide, {"q0": ["1234568"]})[1] == "Please enter a number from 0 to 1234567."
    assert answer({**SLIDER, "max": 1234567}, {"q0": ["-1"]})[1] == "Please choose a point from 0 to 1234567."
    assert (
        answer({**SLIDER, "max": 0.5, "step": 0.1}, {"q0": ["1"]})[1]
        == "Please choose a point from 0 to 0.5."
    )


KINDS = get_args(get_args(Item)[0])
FILLED: dict[str, tuple[dict[str, Any], dict[str, list[str]]]] = {
    "likert": (SCALE, {"q0": ["3"]}),
    "semantic_differential": (SCALE, {"q0": ["3"]}),
    "comparison": (SCALE, {"q0": ["3"]}),
    "single_choice": ({"options": THREE}, {"q0": ["b"]}),
    "multiple_choice": ({"options": THREE}, {"q0": ["a", "c"]}),
    "ranking": ({"options": THREE}, {"q0.a": ["2"], "q0.b": ["3"], "q0.c": ["1"]}),
    "number": ({"min": 0, "max": 1, "whole": False}, {"q0": ["0.25"]}),
    "slider": (SLIDER, {"q0": ["35"]}),
    "short_text": ({}, {"q0": ["fine"]}),
    "long_text": ({}, {"q0": ["fine\nindeed"]}),
}
"""Of each kind one item and a form that answers it."""


@pytest.mark.parametrize("model", KINDS, ids=lambda model: model.__name__)
def test_every_kind_of_item_goes_from_form_to_answer_and_back(model: type[BaseItem]) -> None:
    kind = get_args(model.model_fields["kind"].annotation)[0]
    own, form = FILLED[kind]
    questionnaire = made({"kind": kind, **own})
    answers, problems = validate_answers(questionnaire, form)
    item = questionnaire.items[0]
    assert problems == {}
    assert item.as_sent(answers["q0"]) == form
    assert item.as_sent(None) == {}
    assert stored_item(item.model_dump(mode="json")) == item
    assert validate_answers(questionnaire, {})[1].keys() == {"q0"}


def test_what_was_stored_of_an_item_that_nobody_knows_any_more_is_no_item() -> None:
    assert stored_item(None) is None
    assert stored_item({"kind": "telepathy", "id": "q0", "text": "?"}) is None


def test_labels_are_the_words_that_were_shown() -> None:
    items = made(
        {"kind": "multiple_choice", "options": THREE},
        {"kind": "likert", **SCALE, "scale": 2, "labels": ["low", "high"]},
        {"kind": "likert", **SCALE},
    ).items
    assert items[0].label_of(["a", "c"]) == "A | C"
    assert [item.label_of(2) for item in items[1:]] == ["high", None]
    assert [item.label_of(None) for item in items] == [None, None, None]


def test_subscales_are_averaged_with_reversed_items_turned_round() -> None:
    questionnaire = made(
        {"kind": "likert", **SCALE, "subscale": "trust"},
        {"kind": "likert", **SCALE, "subscale": "trust", "reversed": True},
        {**SLIDER, "subscale": "load"},
        {"kind": "likert", **SCALE},
    )
    answers = {"q0": 6, "q1": 1, "q2": 40, "q3": 2}
    assert subscale_scores(questionnaire.items, answers) == {"trust": 6.5, "load": 40}
    assert subscale_scores(questionnaire.items, {**answers, "q1": None})["trust"] is None


def test_items_in_random_order_stay_behind_what_they_depend_on() -> None:
    questionnaire = made(
        *({"kind": "likert", **SCALE} for _ in range(4)),
        {"kind": "single_choice", "options": OPTIONS},
        {"kind": "short_text", "when": {"item": "q4", "any_of": ["yes"]}},
    ).model_copy(update={"order": "random"})
    orders = {tuple(item_order(questionnaire, np.random.default_rng(seed))) for seed in range(200)}
    assert len(orders) > 60
    for order in orders:
        assert sorted(order) == [f"q{n}" for n in range(6)]
        assert order.index("q5") == order.index("q4") + 1
        arranged = questionnaire.arranged(order)
        form = {"q4": ["no"], **{f"q{n}": ["3"] for n in range(4)}}
        assert validate_answers(arranged, form)[1] == {}
    fixed = questionnaire.model_copy(update={"order": "fixed"})
    assert item_order(fixed, np.random.default_rng(0)) == [f"q{n}" for n in range(6)]


def test_nasa_tlx_has_six_scales_of_twenty_one_gradations_and_fifteen_pairs() -> None:
    """Hart and Staveland (1988); the paper and pencil form, version 1.0."""
    tlx = load_questionnaire(ROOT / "questionnaires" / "nasa-tlx.yaml").value
    assert [item.id for item in tlx.items] == [
        *("mental_demand", "physical_demand", "temporal_demand", "performance", "effort", "frustration")
    ]
    for item in tlx.items:
        assert item.kind == "slider"
        assert (item.max - item.min) / item.step + 1 == 21
    assert (tlx.items[3].low_label, tlx.items[3].high_label) == ("Perfect", "Failure")
    assert subscale_scores(tlx.items, {item.id: 20 * n for n, item in enumerate(tlx.items)}) == {
        "workload": 50
    }
    weights = load_questionnaire(ROOT / "questionnaires" / "nasa-tlx-weights.yaml").value
    pairs = {frozenset(option.value for option in item.options) for item in weights.items}  # type: ignore[union-attr]
    assert len(pairs) == 15
    assert {name for pair in pairs for name in pair} == {item.id.replace("_", "-") for item in tlx.items}


def test_the_fluency_scale_has_the_published_subscales() -> None:
    """Hoffman (2019): fluency 3, relative contribution 4 (two reversed), trust, traits, improvement."""
    scale = load_questionnaire(ROOT / "questionnaires" / "fluency.yaml").value
    counts: dict[str, int] = {}
    for item in scale.items:
        assert item.kind == "likert"
        counts[item.subscale] = counts.get(item.subscale, 0) + 1
    assert counts == {"fluency": 3, "contribution": 4, "trust": 2, "traits": 2, "improvement": 2}
    assert {item.id for item in scale.items if getattr(item, "reversed", False)} == {
        "carried_weight",
        "human_important",
    }


def number(**more: Any) -> Number:
    return Number.model_validate(
        {"kind": "number", "id": "n", "text": "How many?", "min": 0, "max": 9999, **more}
    )


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("1,500", "1,500 can be read in two ways. Please write 1500 or 1.5."),
        ("1.500", "1.500 can be read in two ways. Please write 1500 or 1.5."),
        ("12.345", "12.345 can be read in two ways. Please write 12345 or 12.3450."),
        ("2,000", "2,000 can be read in two ways. Please write 2000 or 2.0."),
    ],
)
def test_f4_a_separator_before_three_digits_is_asked_again(text: str, told: str) -> None:
    with pytest.raises(ValueError, match="can be read in two ways") as caught:
        number(whole=False).answer([text], str)
    assert str(caught.value) == told


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.5", 1.5),
        ("1,5", 1.5),
        ("1,50", 1.5),
        ("0.125", 0.125),
        ("0,125", 0.125),
        ("1.1250", 1.125),
        ("1500", 1500),
    ],
)
def test_f4_numbers_that_read_one_way_are_taken(text: str, value: float) -> None:
    assert number(whole=False).answer([text], str) == value


@pytest.mark.parametrize("text", ["1,500", "1.500", "1 500", "1'500", "1.5e3", "٣٫٥", "½"])
def test_f4_whole_numbers_have_no_separators(text: str) -> None:
    with pytest.raises(ValueError, match="whole number"):
        number().answer([text], str)
