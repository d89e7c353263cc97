"""docs/study-files.md is what the models say, and names every key and kind of them."""

from __future__ import annotations

from typing import get_args

import pytest

from galley.files.reading import FileModel
from tests.study.reference import COMMON, ITEMS, MODELS, PAGE, STAGES, page

TEXT = PAGE.read_text(encoding="utf-8")


def test_the_page_is_made_from_the_models() -> None:
    assert page() == TEXT, "run: python -m tests.study.reference > docs/study-files.md"


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())
def test_every_key_is_described(model: type[FileModel]) -> None:
    for key, field in model.model_fields.items():
        if key != "kind":
            assert field.description, key
            assert f"`{key}`" in TEXT
            assert "|" not in field.description


def test_every_kind_has_a_heading() -> None:
    for model in (*STAGES, *ITEMS):
        kind = get_args(model.model_fields["kind"].annotation)[0]
        assert f"\n### {kind}" in TEXT


def test_keys_told_once_for_all_are_the_same_everywhere() -> None:
    for model in ITEMS:
        for key in COMMON["Item"]:
            assert model.model_fields[key].description == ITEMS[0].model_fields[key].description
