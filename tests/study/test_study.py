from __future__ import annotations

from pathlib import Path

import pytest

from galley.errors import GalleyError, InvalidFiles
from galley.study.study import Study, load_study
from galley.workspace import Workspace
from tests.study.studies import GOOD
from tests.study.workspaces import ROOT, short_workspace, study_workspace


def refused(folder: Path, study: str) -> list[str]:
    with pytest.raises(InvalidFiles) as caught:
        load_study(study_workspace(folder / "w", study), "mine")
    return str(caught.value).splitlines()


def changed(old: str, new: str) -> str:
    assert old in GOOD
    return GOOD.replace(old, new)


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return load_study(study_workspace(tmp_path / "w", GOOD), "mine")


def test_a_study_holds_everything_that_it_names(study: Study) -> None:
    assert (study.name, study.title, study.about) == ("mine", "Good", "")
    assert set(study.questionnaires) == {"before-game", "after-round", "comparison"}
    assert set(study.texts) == {"consent", "instructions", "debrief"}
    assert {name: layout.name for name, layout in study.layouts.items()} == {
        "simple": "cramped_room",
        "cramped_room": "cramped_room",
        "coordination_ring": "coordination_ring",
    }
    assert study.agents == ("stay", "random", "myopic")
    assert (study.config.tick_ms, study.config.horizon_ticks, study.config.abandon_after_s) == (150, 400, 60)


def test_minutes_are_estimated_unless_written(tmp_path: Path, study: Study) -> None:
    # 170 s of texts, 4 + 3 items and 4 x 3 items of 6 s, five rounds of 60 + 3 + 8 s: 639 s.
    assert study.minutes == 11
    assert f"{study.minutes} minutes" in study.texts["consent"].html
    assert "4 rounds of 60 seconds" in study.texts["consent"].html
    written = load_study(study_workspace(tmp_path / "v", "minutes: 25\n" + GOOD), "mine")
    assert written.minutes == 25
    assert "25 minutes" in written.texts["consent"].html


def test_the_hash_changes_with_every_file_that_the_study_names(tmp_path: Path, study: Study) -> None:
    assert load_study(study_workspace(tmp_path / "same", GOOD), "mine").sha256 == study.sha256
    named = [
        "studies/mine.yaml",
        "questionnaires/after-round.yaml",
        "questionnaires/texts/debrief.md",
        "layouts/coordination_ring.yaml",
    ]
    for number, file in enumerate(named):
        workspace = study_workspace(tmp_path / str(number), GOOD)
        path = workspace.path / file
        path.write_text(path.read_text() + "\n")
        assert load_study(workspace, "mine").sha256 != study.sha256, file
    workspace = study_workspace(tmp_path / "other", GOOD)
    (workspace.path / "layouts" / "counter_circuit.yaml").unlink()
    assert load_study(workspace, "mine").sha256 == study.sha256


def test_the_short_study_loads(tmp_path: Path) -> None:
    study = load_study(short_workspace(tmp_path / "w"), "short")
    assert (study.config.tick_ms, study.config.horizon_ticks) == (50, 40)


def test_an_unknown_study_is_told(tmp_path: Path) -> None:
    with pytest.raises(GalleyError, match="no study is named 'mein'; did you mean 'mine'"):
        load_study(study_workspace(tmp_path / "w", GOOD), "mein")


def test_all_problems_come_at_once(tmp_path: Path) -> None:
    study = """\
format: 1
title: Bad
sed: 4
tick_ms: 5
hats: [orange, purple]
completion: {code: a b, redirect: http://x.org}
stages:
  - {kind: consent, text: consnt}
  - {kind: questionnaire, questionnaire: before-gane}
  - {kind: quizz, text: instructions}
  - {kind: tutorial, layout: simpel, agent: stya, horizon_ticks: 0}
  - kind: rounds
    agents: [random, myopia]
    agent_order: shuffled
    after: after-round
    seats: 2
    layouts:
      - {layout: cramped_rom, gaol: 160}
      - {layout: coordination_ring, goal: high}
  - {kind: comparison, questionnaire: comparision}
  - {kind: debrief}
"""
    assert [line.split("; ")[0] for line in refused(tmp_path, study)] == [
        "studies/mine.yaml:1: key 'seed' is missing",
        "studies/mine.yaml:3: key 'sed' is unknown",
        "studies/mine.yaml:4: 'tick_ms' 5 is out of range",
        "studies/mine.yaml:5: 'hats' no. 2 'purple' is unknown",
        "studies/mine.yaml:6: 'completion', 'code' 'a b' has a form that is not allowed",
        "studies/mine.yaml:6: 'completion', 'redirect' 'http://x.org' has a form that is not allowed",
        "studies/mine.yaml:8: no text is named 'consnt'",
        "studies/mine.yaml:9: no questionnaire is named 'before-gane'",
        "studies/mine.yaml:10: kind 'quizz' is unknown in 'stages' no. 3",
        "studies/mine.yaml:11: 'stages' no. 4, 'horizon_ticks' 0 is out of range",
        "studies/mine.yaml:11: no agent is named 'stya'",
        "studies/mine.yaml:11: no layout is named 'simpel'",
        "studies/mine.yaml:13: no agent is named 'myopia'",
        "studies/mine.yaml:14: 'stages' no. 5, 'agent_order' 'shuffled' is unknown",
        "studies/mine.yaml:15: key 'after' is unknown in 'stages' no. 5",
        "studies/mine.yaml:16: 'stages' no. 5, 'seats' 2 is unknown",
        "studies/mine.yaml:18: key 'gaol' is unknown in 'stages' no. 5, 'layouts' no. 1",
        "studies/mine.yaml:18: no layout is named 'cramped_rom'",
        "studies/mine.yaml:19: 'stages' no. 5, 'layouts' no. 2, 'goal' must be a whole number, not 'high'",
        "studies/mine.yaml:20: no questionnaire is named 'comparision'",
        "studies/mine.yaml:21: key 'text' is missing in 'stages' no. 7",
    ]


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("agents: [random, myopic]", "agents: [random, random]", 11, "agent 'random' stands twice"),
        ("agents: [random, myopic]", "agents: [random]", 16, "have 1 agents, not two"),
        ("agents: [random, myopic]", "agents: [random, myopic, stay]", 16, "have 3 agents, not two"),
        ("  - {kind: consent, text: consent}\n", "", 6, "the first stage is not consent"),
        ("  - {kind: debrief, text: debrief}\n", "", 16, "the last stage is not debrief"),
        (
            "{kind: instructions, text: instructions}",
            "{kind: consent, text: consent}",
            8,
            "after another stage",
        ),
        (
            "{kind: instructions, text: instructions}",
            "{kind: debrief, text: debrief}",
            8,
            "comes after debrief",
        ),
        ("{kind: instructions,", "{kind: instructions, id: consent,", 8, "stage id 'consent' stands twice"),
        ("seed: 11", "seed: 11\nhats: [orange, blue, yellow]", 4, "3 hats for a participant"),
        ("seed: 11", "seed: 11\nhats: [orange, blue, blue, yellow]", 4, "hat 'blue' stands twice"),
        ("after_each: after-round", "after_each: comparison", 12, "compares two partners"),
        ("questionnaire: before-game", "questionnaire: comparison", 7, "compares two partners"),
        ("questionnaire: comparison", "questionnaire: after-round", 16, "has no comparison item"),
        (
            "questionnaire: comparison}",
            "questionnaire: comparison, agents: [myopic, stay]}",
            16,
            "not met before",
        ),
        (
            "questionnaire: comparison}",
            "questionnaire: comparison, agents: [myopic, myopic]}",
            16,
            "with itself",
        ),
        ("    after_each:", "    goal_text: '{gaol}'\n    after_each:", 12, "'{gaol}' is unknown"),
    ],
)
def test_stages_must_fit_together(tmp_path: Path, old: str, new: str, line: int, words: str) -> None:
    told = refused(tmp_path, changed(old, new))
    assert len(told) == 1
    assert told[0].startswith(f"studies/mine.yaml:{line}: ")
    assert words in told[0]


def test_problems_of_the_named_files_come_together(tmp_path: Path) -> None:
    workspace = study_workspace(tmp_path / "w", GOOD)
    for file, old, new in [
        ("questionnaires/after-round.yaml", "scale: 7", "scale: 700"),
        ("questionnaires/texts/debrief.md", "# Thank", "Thank"),
        ("layouts/counter_circuit.yaml", "format: 1", "format: 9"),
    ]:
        path = workspace.path / file
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InvalidFiles) as caught:
        load_study(workspace, "mine")
    assert {problem.path for problem in caught.value.problems} == {
        "questionnaires/after-round.yaml",
        "questionnaires/texts/debrief.md",
        "layouts/counter_circuit.yaml",
    }


def test_an_agent_that_cannot_play_a_layout_is_told(tmp_path: Path) -> None:
    workspace = study_workspace(tmp_path / "w", GOOD)
    folder = workspace.path / "agents" / "random"
    (folder / "cook.onnx").write_bytes(b"x")
    (folder / "agent.yaml").write_text(
        "format: 1\nname: random\nkind: network\nlayouts: {cramped_room: cook.onnx}\nencoding: grid\n"
        "sampling: sample\nunstuck_after_ticks: none\n"
    )
    with pytest.raises(InvalidFiles) as caught:
        load_study(workspace, "mine")
    assert str(caught.value) == (
        "studies/mine.yaml:11: agent 'random' cannot play on 'coordination_ring'; "
        "it plays on cramped_room; choose another agent or layout"
    )


def test_the_demo_has_two_agents_on_the_first_layouts_of_the_paper() -> None:
    """COLE paper, Sec. 7.6.1: layouts in a fixed order, two agents a layout, 400 steps in a minute."""
    study = load_study(Workspace(ROOT), "demo")
    kinds = [stage.kind for stage in study.config.stages]
    assert kinds == [
        "consent", "questionnaire", "instructions", "tutorial", "rounds", "comparison", "debrief"
    ]  # fmt: skip
    rounds = next(stage for stage in study.config.stages if stage.kind == "rounds")
    assert rounds.agents == ("human-bc", "myopic")
    order = ["cramped_room", "asymmetric_advantages", "coordination_ring", "forced_coordination"]
    names = [kitchen.layout for kitchen in rounds.layouts]
    assert len(names) >= 3
    assert names[:4] == order[: len(names)]
    assert rounds.layouts[0].goal == 160
    assert study.config.horizon_ticks * study.config.tick_ms == 60_000
