"""A study in a recruiter's frame, handed in there (F13)."""

from __future__ import annotations

import re
from pathlib import Path

import httpx
import pytest

from galley.errors import GalleyError
from galley.server.participant.hand_in import MTURK, hand_in
from galley.server.settings import read_settings
from tests.server.helpers import ONE_ROUND, Participant, serving
from tests.study.workspaces import study_workspace

KEPT = "recruitment: {keep: [workerId, assignmentId, turkSubmitTo]}\nstages:"


def test_f13_a_study_runs_in_a_frame_and_is_handed_in(tmp_path: Path) -> None:
    """The named origins may frame it and get the form; researchers' pages stay out of every frame."""
    lab = study_workspace(tmp_path / "lab", ONE_ROUND.replace("stages:", KEPT))
    with serving(lab, tmp_path / "records.sqlite", framed_by=" ".join(MTURK)) as server:
        headers = httpx.get(f"{server.url}/s/mine").headers
        policy = headers["content-security-policy"]
        assert f"frame-ancestors {' '.join(MTURK)}" in policy
        assert f"form-action 'self' {' '.join(MTURK)}" in policy
        assert "x-frame-options" not in headers
        closed = httpx.get(f"{server.url}/researcher/login").headers
        assert closed["x-frame-options"] == "DENY"
        assert "frame-ancestors 'none'" in closed["content-security-policy"]
        query = "?workerId=w1&assignmentId=a%221&turkSubmitTo=https%3A%2F%2Fworkersandbox.mturk.com"
        person = Participant(server, query=query)
        person.submit({"choice": "decline"})
        form = re.search(r'<form method="post" action="([^"]+)">(.*?)</form>', person.page.text, re.DOTALL)
        assert form
        assert form[1] == "https://workersandbox.mturk.com/mturk/externalSubmit"
        assert 'name="assignmentId" value="a&#34;1"' in form[2]
        finished = Participant(server, query=query.replace("w1", "w2"))
        finished.agree()
        with finished.play() as player:
            player.whole_round()
        page = finished.load().text
        assert 'data-stage="debrief"' in page
        assert 'name="code" value="ONE-1"' in page


def test_f13_nobody_else_frames_it(tmp_path: Path) -> None:
    lab = study_workspace(tmp_path / "lab", ONE_ROUND)
    with serving(lab, tmp_path / "records.sqlite") as server:
        headers = httpx.get(f"{server.url}/s/mine").headers
        assert headers["x-frame-options"] == "DENY"
        assert "frame-ancestors 'none'" in headers["content-security-policy"]


def test_f13_only_to_mturk() -> None:
    """A link cannot send the assignment elsewhere."""
    assert hand_in({"assignmentId": "a", "turkSubmitTo": "https://evil.example"}, "C") is None
    assert hand_in({"assignmentId": "a", "turkSubmitTo": "https://www.mturk.com.evil.example"}, "C") is None
    assert hand_in({"turkSubmitTo": MTURK[0]}, "C") is None
    found = hand_in({"assignmentId": "a", "turkSubmitTo": f"{MTURK[0]}/"}, "C")
    assert found is not None
    assert found["fields"] == {"assignmentId": "a", "code": "C"}


@pytest.mark.parametrize(
    "value", ["mturk.com", "https://a.example; script-src *", "https://a.example/path", "*"]
)
def test_f13_an_origin_that_is_none(value: str) -> None:
    with pytest.raises(GalleyError, match="is no origin"):
        read_settings({"FRAMED_BY": value})
