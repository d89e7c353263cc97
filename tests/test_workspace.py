from __future__ import annotations

from pathlib import Path

import pytest

from galley.errors import GalleyError
from galley.names import name_fix, nearest
from galley.workspace import KINDS, Workspace


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    for folder in ("layouts", "agents/bold", "agents/shy", "questionnaires/texts", "studies", "invitations"):
        (tmp_path / folder).mkdir(parents=True)
    for file in (
        "layouts/ring.yaml",
        "layouts/room.yaml",
        "layouts/notes.txt",
        "layouts/.hidden.yaml",
        "agents/README.md",
        "questionnaires/after.yaml",
        "questionnaires/texts/consent.md",
        "studies/first.yaml",
        "invitations/wave-1.txt",
    ):
        (tmp_path / file).write_text("")
    return Workspace(tmp_path)


def test_things_are_found_by_name(workspace: Workspace) -> None:
    assert [workspace.names(kind) for kind in KINDS] == [
        ("ring", "room"),
        ("bold", "shy"),
        ("after",),
        ("consent",),
        ("first",),
        ("wave-1",),
        (),
    ]
    assert workspace.find("layouts", "ring") == workspace.path / "layouts" / "ring.yaml"
    assert workspace.find("agents", "shy") == workspace.path / "agents" / "shy"
    assert workspace.shown(workspace.find("texts", "consent")) == "questionnaires/texts/consent.md"


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../layouts/ring", "/etc/passwd", "ring.yaml", "ring\0", ".hidden", "notes", "a/b"],
)
def test_no_name_reaches_outside_its_folder(workspace: Workspace, name: str) -> None:
    with pytest.raises(GalleyError):
        workspace.find("layouts", name)


def test_an_unknown_name_is_told_with_the_nearest(workspace: Workspace) -> None:
    with pytest.raises(GalleyError, match=r"^studies: no study is named 'frist'; did you mean 'first'"):
        workspace.find("studies", "frist")
    with pytest.raises(GalleyError, match=r"^agents: no agent is named 'zzz'; use one of bold shy$"):
        workspace.find("agents", "zzz")


def test_a_folder_that_is_no_workspace_is_refused(tmp_path: Path) -> None:
    with pytest.raises(GalleyError, match="galley init DIR"):
        Workspace(tmp_path)
    with pytest.raises(GalleyError, match=r"no such folder; .*galley init DIR"):
        Workspace(tmp_path / "none")


def test_a_kind_without_a_folder_has_no_names(tmp_path: Path) -> None:
    (tmp_path / "layouts").mkdir()
    workspace = Workspace(tmp_path)
    assert workspace.names("agents") == ()
    with pytest.raises(GalleyError, match="there is none yet"):
        workspace.find("agents", "any")


def test_the_starter_workspace_is_there() -> None:
    starter = Workspace(Workspace.starter())
    assert "demo" in starter.names("studies")
    assert "cramped_room" in starter.names("layouts")


def test_nearest_ignores_case_and_gives_up_on_the_unlike() -> None:
    assert nearest("Cramped_Rom", ["cramped_room", "coordination_ring"]) == "cramped_room"
    assert nearest("qqq", ["cramped_room"]) is None
    assert nearest("a", []) is None


def test_long_lists_of_names_are_cut() -> None:
    told = name_fix("zzz", [f"n{i:02}" for i in range(30)])
    assert told.endswith("... (30 in all)")
    assert len(told.split()) < 25
