"""A data set of people who are not there: whole, marked as such everywhere, and nothing else is left."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import time
import zipfile
from pathlib import Path

import pytest

from galley.records.export.columns import SHEETS
from tests.serving import START, run_galley
from tests.simulate.every_item import EVERY, QUIZ, STUDY
from tests.study.workspaces import study_workspace

ARGUMENTS = ("simulate", "every", "--participants", "2", "--seed", "5")


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lab")
    workspace = study_workspace(folder / "lab", STUDY, "every")
    for name, text in (("every", EVERY), ("understood", QUIZ)):
        (workspace.folder("questionnaires") / f"{name}.yaml").write_text(text, encoding="utf-8")
    return workspace.path


@pytest.fixture(scope="module")
def out(lab: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("out") / "pilot"
    place.mkdir()  # an empty folder may be there
    done = run_galley(*ARGUMENTS, "--out", place, "--workspace", lab)
    assert done.returncode == 0, done.stderr
    assert f"{place}/participants.csv: 2 rows" in done.stdout
    return place


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_d10_every_file_of_an_export_is_there(out: Path) -> None:
    files = {sheet.file for sheet in SHEETS} | {
        "data-dictionary.md", "data-dictionary.csv", "trajectories.zip", "human-data.csv", "bonuses.csv"
    }  # fmt: skip
    assert {path.name for path in out.iterdir()} == files
    assert [path.name for path in out.parent.iterdir()] == ["pilot"]


def test_d10_every_row_says_that_nobody_was_there(out: Path) -> None:
    names = {"simulated-0001", "simulated-0002"}
    for sheet in SHEETS:
        found = rows(out / sheet.file)
        assert all(row["participant"] in names for row in found), sheet.file
    assert all("simulated" in row["flags"].split(" | ") for row in rows(out / "participants.csv"))
    assert len(rows(out / "ticks.csv")) > 200
    with zipfile.ZipFile(out / "trajectories.zip") as archive:
        assert all(name.startswith("simulated-") for name in archive.namelist())
    human = (out / "human-data.csv").read_text("utf-8")
    assert "simulated-0001" in human
    dictionary = (out / "data-dictionary.md").read_text("utf-8")
    assert "Simulated" in dictionary.splitlines()[2]
    assert "galley simulate every --participants 2 --seed 5" in dictionary


def test_d10_the_study_has_no_records_of_it(lab: Path, out: Path) -> None:
    assert not (lab / ".data").exists()


def test_d10_a_folder_that_is_not_empty_is_refused_before_anything_is_simulated(lab: Path, out: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in out.iterdir()}
    done = run_galley(*ARGUMENTS, "--out", out, "--workspace", lab)
    assert (done.returncode, done.stderr) == (1, f"{out}: is not empty; name a new folder with --out\n")
    assert {path: path.stat().st_mtime_ns for path in out.iterdir()} == before
    done = run_galley(*ARGUMENTS, "--out", out / "new", "--url", "http://127.0.0.1:1", "--workspace", lab)
    assert done.returncode == 2


@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.full), signal.SIGTERM])
def test_d10_what_is_interrupted_leaves_nothing_behind(lab: Path, tmp_path: Path, number: int) -> None:
    (tmp_path / "tmp").mkdir()
    place = tmp_path / "pilot"
    command = [*START, *ARGUMENTS[:2], "--participants", "50", "--in-flight", "2", "--out", str(place)]
    with subprocess.Popen(
        [*command, "--workspace", str(lab)],
        env={**os.environ, "TMPDIR": str(tmp_path / "tmp")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None
        assert "visits over: 0 of 50" in process.stderr.readline(), "progress is told"
        servers = _servers(tmp_path)
        assert servers
        process.send_signal(number)
        assert process.wait(60) == 130
        assert "Traceback" not in process.stderr.read()
    assert [path.name for path in tmp_path.iterdir()] == ["tmp"]
    assert list((tmp_path / "tmp").glob("galley-*")) == []
    patience = time.monotonic() + 20
    while any(Path(f"/proc/{pid}").exists() for pid in servers):
        assert time.monotonic() < patience, "its server goes on"
        time.sleep(0.05)


def _servers(folder: Path) -> list[str]:
    """The processes that serve from a temporary folder."""
    found = []
    for line in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if f"{folder}/tmp/galley-simulate-".encode() in line.read_bytes():
                found.append(line.parent.name)
        except OSError:  # it ended meanwhile
            continue
    return found
