"""Row D4 as a browser meets it: pages, errors and pages of no study in the visitor's language."""

from __future__ import annotations

import re
from collections.abc import Iterator

import httpx
import pytest

from tests.server.helpers import Served, serving
from tests.study.workspaces import study_workspace

STUDY = """\
format: 1
title: {en: Cook, de: Kochen, ar: طبخ}
languages: [en, de, ar]
seed: 3
completion: {code: DONE}
stages:
  - {kind: consent, text: words}
  - {kind: questionnaire, questionnaire: asked}
  - {kind: debrief, text: words}
"""
ASKED = """\
format: 1
title: {en: Question, de: Frage, ar: سؤال}
source: made up
items:
  - {id: age, kind: number, min: 1, max: 99, text: {en: How old?, de: Wie alt?, ar: كم عمرك؟}}
"""
OWN = 'msgid ""\nmsgstr "Content-Type: text/plain; charset=utf-8\\n"\n\nmsgid "Begin"\nmsgstr "Los geht\'s"\n'
GERMAN = {"accept-language": "de-AT,de;q=0.9,en;q=0.5"}


def step_of(page: httpx.Response) -> str:
    return re.findall(r'name="step" value="([^"]+)"', page.text)[0]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("languages")
    workspace = study_workspace(folder / "w", STUDY)
    (workspace.path / "questionnaires" / "asked.yaml").write_text(ASKED, encoding="utf-8")
    for suffix in ("", ".de", ".ar"):
        (workspace.folder("texts") / f"words{suffix}.md").write_text("# 1\n\n1", encoding="utf-8")
    workspace.folder("catalogues").mkdir()
    (workspace.folder("catalogues") / "de.po").write_text(OWN, encoding="utf-8")
    with serving(workspace, folder / "db.sqlite") as server:
        yield server


def test_d4_a_german_visitor_reads_german_from_landing_to_errors(served: Served) -> None:
    http = served.client()
    landing = http.get("/s/mine", headers=GERMAN)
    assert '<html lang="de" dir="ltr">' in landing.text
    assert "Los geht's" in landing.text
    consent = http.post("/s/mine/begin", data={"language": "de"})
    assert "Ich stimme zu und möchte teilnehmen" in consent.text
    asked = http.post(consent.url.path, data={"step": step_of(consent), "choice": "agree"})
    assert "Wie alt?" in asked.text
    wrong = http.post(asked.url.path, data={"step": step_of(asked), "age": "old"})
    assert wrong.status_code == 422
    assert "Bitte geben Sie eine ganze Zahl ein." in wrong.text
    assert "Bitte sehen Sie sich 1 Antwort noch einmal an." in wrong.text


@pytest.mark.parametrize("path", ["/nowhere", "/s/nowhere", "/v/nowhere"])
def test_d4_pages_of_no_study_speak_the_browser_s_language(served: Served, path: str) -> None:
    http = served.client()
    for headers, language, told in (
        (GERMAN, "de", "Bitte prüfen Sie, ob"),
        ({"accept-language": "fr"}, "en", "Please check that"),
        ({}, "en", "Please check that"),
    ):
        page = http.get(path, headers=headers)
        assert page.status_code == 404
        assert f'<html lang="{language}"' in page.text
        assert told in page.text


def test_d4_a_language_from_the_right_is_laid_out_so(served: Served) -> None:
    """A sibling case: Galley has no Arabic, so its own words stay English in the study's direction."""
    page = served.client().get("/s/mine?language=ar")
    assert '<html lang="ar" dir="rtl">' in page.text
    assert "طبخ" in page.text
    assert "Begin" in page.text
