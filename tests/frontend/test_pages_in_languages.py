"""Row D4: a participant whose language is shipped reads no English word of ours, on any page."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from galley.server.templates import translated_templates
from galley.translations import Catalogues
from tests.frontend.pages import FRONTEND, SAID_ALOUD, Page, variants

CATALOGUES = Catalogues.load()
SHIPPED = [code for code in CATALOGUES.languages if code != "en"]
ENVIRONMENT = translated_templates(str(FRONTEND / "templates"), CATALOGUES)
SAME_IN_BOTH = {"de": {"Start", "Partner", "orange"}, "fr": {"Score", "orange", "12 minutes"}}
"""Words that a language has in common with English."""


def rendered(template: str, values: dict[str, Any], language: str) -> Page:
    return Page(ENVIRONMENT.get_template(template).render(**(values | {"language": language})))


def words(page: Page) -> set[str]:
    """Every run of words that a page shows, says aloud or hands to its scripts."""
    told = {text.strip() for tag, text in page.texts if tag not in ("script", "style")}
    told |= {value for _, attrs in page.tags for key, value in attrs.items() if key in SAID_ALOUD}
    for tag, text in page.texts:
        if tag == "script" and text.strip():
            told |= set(json.loads(text).values())
    return {one for one in told if re.search(r"[^\W\d]", one)}


@pytest.mark.parametrize("language", SHIPPED)
@pytest.mark.parametrize(("template", "values"), [pytest.param(*page[1:], id=page[0]) for page in variants()])
def test_d4_no_english_is_left_on_a_page(template: str, values: dict[str, Any], language: str) -> None:
    english, spoken = (rendered(template, values, code) for code in ("en", language))
    assert spoken.all("html")[0]["lang"] == language
    assert words(english)
    assert words(english) & words(spoken) <= SAME_IN_BOTH.get(language, set())


def test_d4_a_round_in_german() -> None:
    (values,) = (page[2] for page in variants() if page[0] == "round.html")
    page = rendered("round.html", values, "de-AT")
    assert page.all("html", lang="de-AT")
    assert {"Leertaste", "nehmen, ablegen, servieren", "Ihr Partner trägt die", "orange"} <= words(page)
