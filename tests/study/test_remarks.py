"""What `galley check` remarks on without refusing it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from galley.errors import InvalidFiles
from galley.kitchen.layout_file import layout_remarks, load_layout
from galley.study.check import check_workspace
from galley.study.remarks import study_remarks
from galley.study.study import load_study
from galley.workspace import Workspace
from tests.serving import run_galley
from tests.study.workspaces import ROOT, copy_parts

SPARE = """\
format: 1
title: A wide hatch
source: drawn for this test
grid: |
  XXXXXSSSX
  XXO XSSSX
  P 1   2 P
  XXDXXXXXX
"""
MISSING = """\
format: 1
title: What is missing
source: made for this test
items:
  - id: answer
    kind: single_choice
    text: Which?
    options: [{value: "null", label: Nothing}, {value: "none", label: None}, {value: some, label: Some}]
"""
STUDY = """\
format: 1
title: Remarks
seed: 1
languages: [it]
completion: {code: DONE-1}
factors:
  group: {levels: ["NA", control]}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, questionnaire: missing}
  - {kind: rounds, agents: [stay], layouts: [{layout: spare}]}
  - {kind: debrief, text: debrief}
"""


def workspace(folder: Path, layout: str = SPARE) -> Workspace:
    copy_parts(folder)
    texts = folder / "questionnaires" / "texts"
    for name in ("consent", "debrief"):
        found = next(ROOT.rglob(f"texts/{name}.en.md"), None) or next(ROOT.rglob(f"texts/{name}.md"))
        texts.mkdir(exist_ok=True)
        shutil.copy(found, texts / f"{name}.it.md")
    (folder / "layouts" / "spare.yaml").write_text(layout, encoding="utf-8")
    (folder / "questionnaires" / "missing.yaml").write_text(MISSING, encoding="utf-8")
    (folder / "studies").mkdir()
    (folder / "studies" / "remarks.yaml").write_text(STUDY, encoding="utf-8")
    return Workspace(folder)


def test_f16_spare_stations_out_of_reach_are_a_remark(tmp_path: Path) -> None:
    path = tmp_path / "spare.yaml"
    path.write_text(SPARE, encoding="utf-8")
    assert load_layout(path).name == "spare"
    told = [str(remark) for remark in layout_remarks(path, "spare.yaml")]
    assert len(told) == 3
    assert told[0] == (
        "spare.yaml:5: the serving place at column 6 cannot be reached by any chef; "
        "open floor beside it or remove it"
    )


@pytest.mark.parametrize(("tile", "name"), [("O", "onion dispenser"), ("D", "dish dispenser")])
def test_f16_a_kind_that_no_chef_can_reach_is_an_error(tmp_path: Path, tile: str, name: str) -> None:
    path = tmp_path / "shut.yaml"
    rows = (
        SPARE.replace("XXO X", "XXX X").replace("XXDXX", "XXXXX").replace("XXXXXSSSX", f"X{tile}XXXSSSX", 1)
    )
    other = {"O": "D", "D": "O"}[tile]
    path.write_text(rows.replace("P 1   2 P", f"{other} 1   2 P"), encoding="utf-8")
    with pytest.raises(InvalidFiles, match=f"the {name} at column 2 cannot be reached by any chef"):
        load_layout(path)


def test_f21_d4_missing_words_and_languages_without_a_catalogue_are_remarked(
    tmp_path: Path,
) -> None:
    place = workspace(tmp_path / "lab")
    told = [str(remark) for remark in study_remarks(place, load_study(place, "remarks"))]
    assert any(one.startswith("studies/remarks.yaml:7: 'NA' is what pandas and R read as") for one in told)
    assert sum("questionnaires/missing.yaml:8: 'n" in one for one in told) == 2
    assert any("no catalogue for 'it'" in one for one in told)
    assert not any("'control'" in one or "'some'" in one for one in told)


def test_f14_answers_that_proxies_may_not_pass_on_are_remarked(tmp_path: Path) -> None:
    place = workspace(tmp_path / "lab")
    asked = "".join(f"  - {{id: q{n}, kind: long_text, text: More?, max_length: 20000}}\n" for n in range(6))
    file = place.folder("questionnaires") / "missing.yaml"
    file.write_text(MISSING + asked, encoding="utf-8")
    told = [str(remark) for remark in study_remarks(place, load_study(place, "remarks"))]
    assert any("questionnaires/missing.yaml:4: the longest answers take 1.0 MiB" in one for one in told)


def test_d14_one_study_is_checked_alone_and_remarks_come_first(tmp_path: Path) -> None:
    place = workspace(tmp_path / "lab")
    (place.folder("studies") / "broken.yaml").write_text("format: 1\n", encoding="utf-8")
    for line in (["check", "--study", "remarks"], ["check", "remarks"]):
        done = run_galley(*line, cwd=place.path)
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith("Remark: ")
        assert done.stdout.endswith("No problems in remarks.\n")
    assert any("studies/broken.yaml" in str(one) for one in check_workspace(place))
