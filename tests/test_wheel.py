"""The wheel serves on its own: `pip install galley-*.whl && galley init demo && galley serve demo`."""

from __future__ import annotations

import shutil
import subprocess
import sys
import urllib.request
import zipfile
from pathlib import Path

import pytest

from tests.serving import START, served

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(out)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (built,) = out.glob("galley-*.whl")
    return built


def tracked(*folders: str) -> set[str]:
    listed = subprocess.run(
        ["git", "ls-files", *folders], cwd=ROOT, check=True, capture_output=True, text=True
    )
    return set(listed.stdout.split("\n")) - {""}


def test_the_wheel_holds_code_frontend_and_starter_workspace(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {name.removeprefix("backend/") for name in tracked("backend/galley")} <= names
    assert {f"galley/_{name}" for name in tracked("frontend")} <= names
    starter = tracked("layouts", "agents", "questionnaires", "studies")
    assert {f"galley/_starter/{name}" for name in starter} <= names
    assert not [name for name in names if name.startswith(("tests/", "backend/", "benchmarks/"))]


def write_own_catalogue(lab: Path) -> None:
    """Row D4: `locale/LANGUAGE.po` of a workspace stands over the catalogue in the wheel."""
    (lab / "locale").mkdir()
    text = 'msgid ""\nmsgstr "Content-Type: text/plain; charset=utf-8\\n"\n\nmsgid "Begin"\nmsgstr "开工"\n'
    (lab / "locale" / "zh.po").write_text(text, encoding="utf-8")


def test_the_installed_wheel_makes_a_workspace_and_serves_it_without_pytorch(
    wheel: Path, tmp_path: Path
) -> None:
    site = tmp_path / "site"
    install = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--target",
        str(site),
        str(wheel),
    ]
    subprocess.run(install, check=True, capture_output=True)
    (site / "torch.py").write_text("raise ImportError('serving must not need PyTorch')\n")
    for kept in (ROOT / "backend").rglob("*.nb[ci]"):  # what an earlier start would have compiled
        beside = site / kept.relative_to(ROOT / "backend")
        beside.parent.mkdir(exist_ok=True)
        shutil.copy(kept, beside)
    environment = {"PYTHONPATH": str(site)}
    lab = tmp_path / "lab"
    subprocess.run([*START, "init", str(lab)], check=True, env=environment, cwd=tmp_path, capture_output=True)
    assert (lab / "studies" / "demo.yaml").is_file()
    write_own_catalogue(lab)
    with served(lab, f"sqlite:///{tmp_path}/records.sqlite", environment=environment) as server:
        with urllib.request.urlopen(f"{server.url}/s/demo", timeout=30) as answer:
            page = answer.read().decode()
        with urllib.request.urlopen(f"{server.url}/s/demo?language=zh", timeout=30) as answer:
            chinese = answer.read().decode()
        with urllib.request.urlopen(f"{server.url}/healthz", timeout=30) as answer:
            assert answer.status == 200
    assert "Begin" in page
    assert "开工" in chinese
    assert "游戏就在这个窗口中进行" in chinese
    assert str(ROOT) not in page
