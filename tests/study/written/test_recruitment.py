from __future__ import annotations

from pathlib import Path

import pytest

from galley.errors import InvalidFiles
from galley.study.check import check_workspace
from galley.study.study import load_study
from galley.study.written.recruitment import is_placeholder, load_invitations
from tests.study.studies import GOOD
from tests.study.workspaces import study_workspace

INVITED = GOOD.replace("seed: 11\n", "seed: 11\nrecruitment: {invitations: wave, participant: workerId}\n")


def test_only_the_parameters_named_are_kept(tmp_path: Path) -> None:
    study = load_study(study_workspace(tmp_path / "w", GOOD), "mine")
    link = {"PROLIFIC_PID": "5f\n\0x", "utm_source": "mail", "hitId": "3" * 500}
    assert study.kept(link) == {"PROLIFIC_PID": "5fx", "hitId": "3" * 200}
    only = GOOD.replace("seed: 11\n", "seed: 11\nrecruitment: {keep: [lab]}\n")
    assert load_study(study_workspace(tmp_path / "v", only), "mine").kept({"lab": "a", "hitId": "b"}) == {
        "lab": "a"
    }


def test_invitations_are_read_and_do_not_change_the_hash_of_the_study(tmp_path: Path) -> None:
    workspace = study_workspace(tmp_path / "w", INVITED)
    (workspace.path / "invitations").mkdir()
    codes = workspace.path / "invitations" / "wave.txt"
    codes.write_text("# the first wave\nalpha-01\n\n  alpha-02\n")
    study = load_study(workspace, "mine")
    assert study.invitations == {"alpha-01", "alpha-02"}
    codes.write_text("alpha-01\nalpha-02\nalpha-03\n")
    assert load_study(workspace, "mine").sha256 == study.sha256
    assert check_workspace(workspace) == []


def test_bad_invitations_are_told(tmp_path: Path) -> None:
    path = tmp_path / "wave.txt"
    path.write_text("alpha-01\nshort\nalpha-01\nalpha 02\n")
    with pytest.raises(InvalidFiles) as caught:
        load_invitations(path, "invitations/wave.txt")
    assert str(caught.value).splitlines() == [
        "invitations/wave.txt:2: 'short' is no code; use 6 to 64 letters, digits, - and _",
        "invitations/wave.txt:3: code 'alpha-01' stands here again (first on line 1); remove one of the two",
        "invitations/wave.txt:4: 'alpha 02' is no code; use 6 to 64 letters, digits, - and _",
    ]
    path.write_text("# none yet\n")
    with pytest.raises(InvalidFiles, match="there is no code in the file"):
        load_invitations(path, "invitations/wave.txt")


def test_an_unknown_list_and_an_unkept_person_are_told(tmp_path: Path) -> None:
    with pytest.raises(InvalidFiles, match="no list of invitations is named 'wave'"):
        load_study(study_workspace(tmp_path / "w", INVITED), "mine")
    unkept = INVITED.replace("workerId", "workerID").replace("invitations: wave, ", "")
    with pytest.raises(InvalidFiles, match="parameter 'workerID' is not kept; did you mean 'workerId'"):
        load_study(study_workspace(tmp_path / "v", unkept), "mine")


@pytest.mark.parametrize(
    "value",
    [
        *("{{%PROLIFIC_PID%}}", "%7B%7B%25PROLIFIC_PID%25%7D%7D", "undefined", "null", "[id]", "None", "NaN"),
        *(
            "${e://Field/PROLIFIC_PID}",
            "<ID>",
            "__PROLIFIC_PID__",
            ":participant",
            "prolific-pid",
        ),
        *("[object Object]", "ASSIGNMENT_ID_NOT_AVAILABLE", "--", "{PID}", " ", ""),
    ],
)
def test_f1_a_placeholder_is_nobodys_id(value: str) -> None:
    assert is_placeholder(value, "PROLIFIC_PID")


@pytest.mark.parametrize(
    "value",
    [
        "5f3a9b0c1d2e3f4a5b6c7d8e",
        "A1B2C3D4E5F6G7",
        "auth0|5f3a",
        "p.lee+2@uni.example",
        "7",
        "0",
        "subject-12",
    ],
)
def test_f1_ids_of_people_are_no_placeholders(value: str) -> None:
    assert not is_placeholder(value, "PROLIFIC_PID")
