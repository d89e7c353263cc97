from __future__ import annotations

from pathlib import Path

from galley.study.check import check_workspace, describe
from galley.study.study import load_study
from galley.workspace import Workspace
from tests.study.studies import GOOD
from tests.study.workspaces import ROOT, short_workspace, study_workspace


def test_the_workspaces_that_come_with_galley_have_no_problem(tmp_path: Path) -> None:
    assert check_workspace(Workspace(ROOT)) == []
    assert check_workspace(short_workspace(tmp_path / "w")) == []


def test_every_kind_of_file_is_checked_named_or_not(tmp_path: Path) -> None:
    workspace = study_workspace(tmp_path / "w", GOOD.replace("text: consent", "text: consnt"))
    (workspace.path / "layouts" / "loose.yaml").write_text("format: 2\n")
    (workspace.path / "questionnaires" / "loose.yaml").write_text("")
    (workspace.path / "questionnaires" / "texts" / "loose.md").write_text("no heading")
    (workspace.path / "studies" / "loose.yml").write_text("format: 1\n")
    (workspace.path / "studies" / "a name.yaml").write_text("format: 1\n")
    told = [str(problem) for problem in check_workspace(workspace)]
    assert {line.split(":")[0] for line in told} == {
        "layouts/loose.yaml",
        "questionnaires/loose.yaml",
        "questionnaires/texts/loose.md",
        "studies/a name.yaml",
        "studies/loose.yml",
        "studies/mine.yaml",
    }
    assert (
        "studies/loose.yml: only .yaml files are read here; rename it to loose.yaml, or move it elsewhere"
        in told
    )
    assert len(told) == len(set(told))


def test_a_workspace_without_a_study_is_told(tmp_path: Path) -> None:
    workspace = study_workspace(tmp_path / "w", GOOD)
    (workspace.path / "studies" / "mine.yaml").unlink()
    assert [str(problem) for problem in check_workspace(workspace)] == [
        "studies: there is no study; write one, see docs/first-study.md"
    ]


def test_a_description_tells_what_participants_will_see(tmp_path: Path) -> None:
    study = load_study(study_workspace(tmp_path / "w", GOOD), "mine")
    assert (
        describe(study)
        == """\
mine: Good, about 11 minutes
   1 consent: text 'Before you take part'
   2 questionnaire: questionnaire 'A few questions about you', 4 items
   3 instructions: text 'How to cook'
   4 tutorial: simple with stay, 60 s
   5 rounds: 4 rounds of 60 s (400 ticks)
       after each: questionnaire 'How was this round?', 3 items
       layouts, in this order: cramped_room (goal 160), coordination_ring
       agents, in an order drawn for each layout: random, myopic
       seat of the participant: drawn for each layout
       cells: 4 orders x 4 seatings
   6 comparison: questionnaire 'Your two partners', 3 items, comparing the two partners
   7 debrief: text 'Thank you for cooking'
     hats, drawn for each visit from: orange, sky-blue (light blue), bluish-green (green), yellow, \
blue (dark blue), vermillion (red), reddish-purple (pink)
     completion code: DONE"""
    )
