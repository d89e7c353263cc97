"""docs/first-study.md names every key that a study or a questionnaire may have, and every kind of them."""

from __future__ import annotations

import re
from typing import get_args

import pytest

from galley.files import FileModel
from galley.study import config, items, questionnaire, texts
from tests.study.workspaces import ROOT

PAGE = (ROOT / "docs" / "first-study.md").read_text(encoding="utf-8")
STAGES = get_args(get_args(config.Stage)[0])
ITEMS = get_args(get_args(items.Item)[0])
MODELS: list[type[FileModel]] = [
    config.StudyFile,
    config.Completion,
    config.Kitchen,
    questionnaire.Questionnaire,
    items.Option,
    items.When,
    *STAGES,
    *ITEMS,
]


def in_code(word: str) -> bool:
    return re.search(rf"`[^`\n]*\b{re.escape(word)}\b[^`\n]*`", PAGE) is not None


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_every_key_is_told(model: type[FileModel]) -> None:
    assert [key for key in model.model_fields if not in_code(key)] == []


def test_every_kind_hat_and_picture_is_told() -> None:
    kinds = [get_args(model.model_fields["kind"].annotation)[0] for model in (*STAGES, *ITEMS)]
    assert [word for word in (*kinds, *config.HATS, *texts.PLACEHOLDERS) if not in_code(word)] == []
    assert [name for name in texts.PICTURES if name not in PAGE] == []
