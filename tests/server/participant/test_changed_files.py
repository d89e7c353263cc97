"""Files that change under visits under way: rows F3 and A1, and their siblings."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path

import pytest

from galley.commands.check import changed_under_way
from galley.records.database.tables import RESPONSES, VISITS
from galley.records.reading.overdue import under_way
from galley.server.changed_files import kept_by, told_of_changes
from galley.server.content import load_content
from galley.workspace import KINDS, Workspace
from tests.server.helpers import Participant, Served, serving
from tests.study.workspaces import study_workspace

STUDY = """
format: 1
title: Two days
seed: 1
tick_ms: 20
countdown_s: 0
completion: {code: DONE}
endings: {interrupted: {code: CUT}}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, id: q, questionnaire: day}
  - {kind: instructions, id: read, text: more}
  - {kind: rounds, id: play, agents: [myagent], layouts: [{layout: mykitchen}], horizon_ticks: 20}
  - {kind: debrief, text: debrief}
"""
DAY = "format: 1\ntitle: Today\nsource: made for this\norder: random\nitems:\n"
ITEM = "  - {{kind: short_text, id: {0}, text: {0}}}\n"


def day(*items: str) -> str:
    """A questionnaire of short texts."""
    return DAY + "".join(map(ITEM.format, items))


@pytest.fixture
def lab(tmp_path: Path) -> Workspace:
    made = study_workspace(tmp_path / "lab", STUDY)
    shutil.copytree(made.path / "agents" / "random", made.path / "agents" / "myagent")
    (made.path / "questionnaires" / "day.yaml").write_text(day("a", "b", "c"))
    (made.folder("texts") / "more.md").write_text("# More\n\nRead this.\n")
    source = next((made.path / "layouts").glob("cramped_room.*"))
    copy = source.with_name("mykitchen" + source.suffix)
    lines = source.read_text().replace("cramped_room", "mykitchen").splitlines(keepends=True)
    copy.write_text("".join(line for line in lines if not line.startswith("aliases")))
    for file in (made.path / "agents" / "myagent").glob("*.yaml"):
        file.write_text(file.read_text().replace("name: random", "name: myagent"))
    return made


def edit(lab: Workspace, old: str, new: str) -> None:
    path = lab.path / "studies" / "mine.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def at(served: Served, stage: str) -> Participant:
    """Somebody who came to a stage: q, read or play."""
    person = Participant(served)
    person.agree()
    if stage != "q":
        person.submit(dict.fromkeys("abc", "yes"))
    if stage == "play":
        person.submit()
    return person


def back(served: Served, person: Participant) -> Participant:
    person.served, person.http = served, served.client()
    person.load()
    return person


def told(served: Served) -> list[str]:
    content = load_content(served.workspace)
    has = kept_by(content.layouts, content.agents)
    return list(told_of_changes(served.store.read(under_way).result(), content.studies, has))


def test_f3_an_item_is_gone_and_the_visit_goes_on(lab: Workspace, tmp_path: Path) -> None:
    with serving(lab, tmp_path / "db") as served:
        person = at(served, "q")
    (lab.path / "questionnaires" / "day.yaml").write_text(day("a", "b"))
    with serving(lab, tmp_path / "db") as served:
        (line,) = told(served)
        assert "1 visit under way" in line
        assert "item day.c" in line
        assert "go on without" in line
        assert back(served, person).page.status_code == 200
        assert 'name="c"' not in person.page.text
        assert person.submit({"a": "1", "b": "2"}).status_code == 200
        assert person.stage == "instructions"
        rows = served.store.read(lambda connection: connection.execute(RESPONSES.select()).all()).result()
        assert {row.item for row in rows} == {"a", "b"}


def test_a1_an_item_is_new_and_old_visits_are_not_asked(lab: Workspace, tmp_path: Path) -> None:
    with serving(lab, tmp_path / "db") as served:
        person = at(served, "q")
    (lab.path / "questionnaires" / "day.yaml").write_text(day("a", "b", "c", "d"))
    with serving(lab, tmp_path / "db") as served:
        assert told(served) == []
        assert 'name="d"' not in back(served, person).page.text
        assert person.submit(dict.fromkeys("abc", "yes")).status_code == 200
        assert person.stage == "instructions"


@pytest.mark.parametrize(
    ("stage", "old", "new", "named"),
    [
        ("q", "questionnaire: day", "questionnaire: before-game", "questionnaire day"),
        ("read", "text: more", "text: instructions", "text more"),
        ("play", "layout: mykitchen", "layout: cramped_room", "layout mykitchen"),
        ("play", "[myagent]", "[random]", "agent myagent"),
    ],
)
def test_a1_what_a_page_needs_is_gone(
    lab: Workspace, tmp_path: Path, stage: str, old: str, new: str, named: str
) -> None:
    with serving(lab, tmp_path / "db") as served:
        person = at(served, stage)
    edit(lab, old, new)
    kind, name = named.split()
    folders = [one for one in KINDS if one == f"{kind}s"]
    for path in lab.folder(folders[0]).glob(f"{name}*"):
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    with serving(lab, tmp_path / "db") as served:
        (line,) = told(served)
        assert named in line
        assert "interrupted" in line
        assert back(served, person).page.status_code == 200
        assert person.stage == "ending"
        assert "CUT" in person.page.text
        (row,) = served.store.read(lambda connection: connection.execute(VISITS.select()).all()).result()
        assert (row.status, row.completion_code) == ("interrupted", "CUT")


def test_a1_a_round_under_way_keeps_its_layout(lab: Workspace, tmp_path: Path) -> None:
    with serving(lab, tmp_path / "db") as served:
        person = at(served, "play")
        with person.play() as player:
            player.hello()
    edit(lab, "layout: mykitchen", "layout: cramped_room")
    for path in (lab.path / "layouts").glob("mykitchen*"):
        path.unlink()
    with serving(lab, tmp_path / "db") as served:
        assert back(served, person).page.status_code == 200
        with person.play() as player:
            player.whole_round()
        person.load()
        assert person.stage == "debrief"


def test_a1_stages_in_another_order(lab: Workspace, tmp_path: Path) -> None:
    with serving(lab, tmp_path / "db") as served:
        person = at(served, "q")
    asked, read = STUDY.splitlines()[10:12]
    edit(lab, f"{asked}\n{read}", f"{read}\n{asked}")
    with serving(lab, tmp_path / "db") as served:
        assert back(served, person).stage == "questionnaire"
        person.submit(dict.fromkeys("abc", "yes"))
        assert person.stage == "instructions"


def test_a1_a_study_renamed(lab: Workspace, tmp_path: Path) -> None:
    with serving(lab, tmp_path / "db") as served:
        person = at(served, "read")
    old = lab.path / "studies" / "mine.yaml"
    old.rename(old.with_name("other.yaml"))
    with serving(lab, tmp_path / "db") as served:
        (line,) = told(served)
        assert line.startswith("studies/mine: 1 visit under way, but this study is not served")
        assert back(served, person).page.status_code == 410
        assert "stored" in person.page.text
    old.with_name("other.yaml").rename(old)
    with serving(lab, tmp_path / "db") as served:
        assert back(served, person).stage == "instructions"


def test_f3_check_tells(lab: Workspace) -> None:
    Path(lab.database).parent.mkdir()
    with serving(lab, Path(lab.database)) as served:
        at(served, "q")
    (lab.path / "questionnaires" / "day.yaml").write_text(day("a", "b"))
    (line,) = changed_under_way(lab)
    assert "1 visit under way were to be asked what is gone: item day.c" in line


@pytest.mark.full
def test_f3_two_hundred_visits_under_way(lab: Workspace, tmp_path: Path) -> None:
    with serving(lab, tmp_path / "db") as served:
        people = [at(served, ("q", "read", "play")[number % 3]) for number in range(200)]
    (lab.path / "questionnaires" / "day.yaml").write_text(day("a", "b", "d"))
    edit(lab, "text: more", "text: instructions")
    edit(lab, "layout: mykitchen", "layout: cramped_room")
    edit(lab, "[myagent]", "[random]")
    shutil.rmtree(lab.path / "agents" / "myagent")
    for path in (lab.path / "layouts").glob("mykitchen*"):
        path.unlink()
    ends: Counter[str] = Counter()
    with serving(lab, tmp_path / "db") as served:
        assert [line.split()[1] for line in told(served)] == ["200", "67"]
        for person in people:
            assert back(served, person).page.status_code == 200
            if person.stage == "questionnaire":
                ends["went on"] += 1
                assert person.submit({"a": "1", "b": "2"}).status_code == 200
            assert person.stage == "ending"
            assert "CUT" in person.page.text
            ends["ended"] += 1
        rows = served.store.read(lambda connection: connection.execute(RESPONSES.select()).all()).result()
    assert ends == {"went on": 67, "ended": 200}
    assert len(rows) == 67 * 2 + 133 * 3
