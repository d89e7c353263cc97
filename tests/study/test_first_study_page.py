"""docs/first-study.md shows every kind of question, hat and picture by an example or a name."""

from __future__ import annotations

import re

from galley.study.written import study_file as config
from galley.study.written import texts
from tests.study.workspaces import ROOT

PAGE = (ROOT / "docs" / "first-study.md").read_text(encoding="utf-8")


def test_every_hat_and_picture_is_told() -> None:
    for word in (*config.HATS, *texts.PLACEHOLDERS):
        assert re.search(rf"`[^`\n]*\b{re.escape(word)}\b[^`\n]*`", PAGE), word
    assert [name for name in texts.PICTURES if name not in PAGE] == []
