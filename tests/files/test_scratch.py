"""What programs leave that were killed goes at the next run: only ours, and only if nobody works there."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from galley.files import scratch as scratches
from galley.files.scratch import Scratch
from galley.files.whole import PART, clear_left, whole_folder, whole_path
from galley.runs.run_folder import RunFolder
from galley.runs.state_file import NumpyStates
from tests.agents.admission.newcomers import let_in, workspace
from tests.agents.policies import linear_policy

IN_A_FOLDER = """
from galley.files.whole import whole_folder
from pathlib import Path
with whole_folder(Path("agents/cook"), replace=True) as folder:
    (folder / "half").write_text("made")
    print("there", flush=True)
    input()
"""
IN_A_FILE = """
from galley.files.whole import whole_path
from pathlib import Path
with whole_path(Path("table.csv")) as part:
    part.write_text("half")
    print("there", flush=True)
    input()
"""


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@contextmanager
def working(program: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A process that is in the middle of it."""
    with subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "there\n"
        try:
            yield process
        finally:
            process.kill()


def killed(program: str, folder: Path) -> None:
    with working(program, folder) as process:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()


def test_a13_the_hidden_folder_of_agents_add_that_was_killed_goes_with_the_next_agent(tmp_path: Path) -> None:
    place = workspace(tmp_path)
    killed(IN_A_FOLDER, tmp_path)
    agents = place.folder("agents")
    assert len(names(agents)) == 1
    (agents / ".part-mine").mkdir()
    (agents / ".note").mkdir()
    path = tmp_path / "policy.onnx"
    path.write_bytes(linear_policy())
    let_in(place, {"room": path})
    assert names(agents) == [".note", ".part-mine", "guest"], "what is not of our making stays"


def test_a13_the_folder_of_a_process_that_lives_stays(tmp_path: Path) -> None:
    with working(IN_A_FOLDER, tmp_path) as process:
        (half,) = (tmp_path / "agents").iterdir()
        with whole_folder(tmp_path / "agents" / "other"):
            assert (half / "cook" / "half").exists()
        process.communicate("\n")
        assert process.returncode == 0
    assert names(tmp_path / "agents") == ["cook", "other"]


def test_a13_an_agent_that_was_being_replaced_is_put_back(tmp_path: Path) -> None:
    agents = tmp_path / "agents"
    with whole_folder(agents / "cook") as folder:
        (folder / "former").write_text("good")
    killed(IN_A_FOLDER, tmp_path)
    (left,) = agents.glob(".part-*")
    (agents / "cook").rename(left / ".former")  # killed right after this step
    with whole_folder(agents / "other"):
        pass
    assert names(agents) == ["cook", "other"]
    assert names(agents / "cook") == ["former"]


def test_a13_folders_of_earlier_versions_go_when_they_are_old(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = tmp_path / ".part-abcdefgh"
    old.mkdir()
    with Scratch(".part-", tmp_path):
        assert old.exists(), "it may be at work"
    monkeypatch.setattr(scratches.time, "time", lambda: old.stat().st_mtime + 2 * scratches.OF_OLD_S)
    with Scratch(".part-", tmp_path):
        pass
    assert names(tmp_path) == []


def test_a13_links_are_not_followed(tmp_path: Path) -> None:
    (tmp_path / "else").mkdir()
    (tmp_path / "else" / ".lock").touch()
    (tmp_path / ".part-abcdefgh").symlink_to("else")
    with Scratch(".part-", tmp_path):
        pass
    assert names(tmp_path) == [".part-abcdefgh", "else"]


def test_a13_a_child_that_has_the_lock_keeps_the_folder(tmp_path: Path) -> None:
    made = Scratch("ours-", tmp_path)
    with subprocess.Popen(
        [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=[made.descriptor]
    ) as child:
        os.close(made.descriptor)  # as if this process had been killed
        with Scratch("ours-", tmp_path):
            assert made.path.exists()
        child.communicate(b"\n")
    with Scratch("ours-", tmp_path) as folder:
        assert names(tmp_path) == [folder.name]


def test_a13_a_file_that_was_half_written_goes_unless_somebody_writes_it(tmp_path: Path) -> None:
    killed(IN_A_FILE, tmp_path)
    half = f".table.csv{PART}"
    assert names(tmp_path) == [half]
    clear_left(tmp_path)
    assert names(tmp_path) == []
    (tmp_path / ".others.part").touch()
    with working(IN_A_FILE, tmp_path) as process:
        clear_left(tmp_path)
        assert names(tmp_path) == [".others.part", half]
        process.communicate("\n")
    assert (tmp_path / "table.csv").read_text("utf-8") == "half"


def test_a13_a_run_that_goes_on_clears_what_the_killed_one_left(tmp_path: Path) -> None:
    run = RunFolder(tmp_path / "run", {}, columns=[], states=NumpyStates(), provenance={})
    with pytest.raises(ZeroDivisionError), whole_path(tmp_path / "run" / "state"):
        assert 1 // 0
    for place in (tmp_path / "run", tmp_path / "run" / "members"):
        (place / f".state{PART}").touch()
    with run.lock("trains"):
        assert [*(tmp_path / "run").rglob(f"*{PART}")] == []
