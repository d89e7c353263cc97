"""The command line: quick help, one line per mistake, and exit codes that scripts can rely on."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import galley
from galley.extras import EXTRA_OF
from tests.serving import run_galley

ROOT = Path(__file__).parents[1]
HEAVY = ("numpy", "numba", "onnxruntime", "torch", "sqlalchemy", "starlette", "pydantic", "jinja2")


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return run_galley(*arguments, cwd=ROOT)


def one_line(text: str) -> bool:
    return text.count("\n") == 1 and "Traceback" not in text


def test_version_is_the_packages() -> None:
    assert run("--version").stdout == f"galley {galley.__version__}\n"


def test_help_loads_nothing_heavy() -> None:
    code = f"import sys, galley.cli; print([name for name in {HEAVY!r} if name in sys.modules])"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout == "[]\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["agents", "play", "stay"],
        ["serve", "--port", "70000"],
        ["export", "demo"],
        ["check", "--loud"],
    ],
)
def test_wrong_usage_exits_2(arguments: list[str]) -> None:
    done = run(*arguments)
    assert done.returncode == 2
    assert "Usage:" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["check", "no-such-folder"], "no such folder"),
        (["check", "tests"], "galley init DIR"),
        (["serve", "no-such-folder"], "no such folder"),
        (["export", "demo", "--out", "x", "--database", "no-such.sqlite"], "no-such.sqlite"),
        (["export", "demo", "--out", "x", "--database", "oracle://x"], "oracle"),
        (["init", "tests"], "not an empty folder"),
        (["agents", "play", "nobody", "stay", "--layout", "cramped_room"], "nobody"),
        (["agents", "play", "stay", "stay", "--layout", "nowhere"], "nowhere"),
        (["trajectories", "import", "README.md"], "README.md"),
        (["trajectories", "import", "no-such.pickle"], "no-such.pickle"),
        (["trajectories", "measure", "README.md"], "README.md"),
    ],
)
def test_a_users_mistake_is_one_line_and_exits_1(arguments: list[str], said: str, tmp_path: Path) -> None:
    done = run(*arguments)
    assert done.returncode == 1
    assert one_line(done.stderr), done.stderr
    assert said in done.stderr


def test_the_starter_workspace_has_no_problems(tmp_path: Path) -> None:
    made = run("init", tmp_path / "lab")
    assert made.returncode == 0, made.stderr
    checked = run("check", tmp_path / "lab")
    assert checked.returncode == 0, checked.stderr
    assert "No problems" in checked.stdout
    assert "demo" in checked.stdout


def test_check_tells_every_problem_of_every_kind_with_its_line(tmp_path: Path) -> None:
    lab = tmp_path / "lab"
    assert run("init", lab).returncode == 0
    (lab / "layouts" / "broken.yaml").write_text("format: 1\nname: broken\ngrid: |\n  XQX\n  X1X\n  XXX\n")
    (lab / "agents" / "ghost").mkdir()
    (lab / "agents" / "ghost" / "agent.yaml").write_text(
        "format: 1\nname: ghost\nkind: wizard\nlayouts: any\n"
    )
    study = lab / "studies" / "demo.yaml"
    study.write_text(study.read_text() + "surprise: 1\n")
    done = run("check", lab)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    for place in ("layouts/broken.yaml:", "agents/ghost/agent.yaml:", "studies/demo.yaml:"):
        assert place in done.stderr


def test_agents_are_listed_for_machines(tmp_path: Path) -> None:
    rows = [json.loads(line) for line in run("agents", "list", "--json").stdout.splitlines()]
    assert {"stay", "random", "myopic", "human-bc", "human-proxy"} <= {row["name"] for row in rows}
    assert all(len(row["sha256"]) == 64 for row in rows)


def test_play_gives_both_seat_orders_and_repeats_itself() -> None:
    arguments = (
        "agents",
        "play",
        "random",
        "stay",
        "--layout",
        "cramped_room",
        "--games",
        "2",
        "--seed",
        "7",
        "--json",
    )
    first, again = run(*arguments), run(*arguments)
    rows = [json.loads(line) for line in first.stdout.splitlines()]
    assert [row["seats"] for row in rows] == [["random", "stay"], ["stay", "random"]]
    assert all(row["games"] == 2 and row["standard_error"] >= 0 for row in rows)
    assert first.stdout == again.stdout


@pytest.mark.parametrize(
    ("library", "extra", "line"),
    [
        ("torch", "learn", "learn train sp --layout cramped_room --out run"),
        ("torch", "learn", "learn export run --name mine"),
        ("tqdm", "learn", "learn bc"),
        ("matplotlib", "plot", "learn plot curves run --out x.svg"),
        ("distributed", "evaluate", "evaluate cramped_room --workers 2"),
    ],
)
def test_f18_a_command_without_its_extra_says_so_in_one_line(
    tmp_path: Path, library: str, extra: str, line: str
) -> None:
    program = (
        f"import sys; sys.modules[{library!r}] = None\n"
        "import importlib.util; found = importlib.util.find_spec\n"
        f"importlib.util.find_spec = lambda name, *a: None if name == {library!r} else found(name, *a)\n"
        f"sys.argv = ['galley', *{line.split()!r}]; from galley.cli import main; main()"
    )
    (tmp_path / "layouts").mkdir()
    shutil.copy(ROOT / "layouts" / "cramped_room.yaml", tmp_path / "layouts")
    told = {"capture_output": True, "text": True, "timeout": 120, "check": False}
    run = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, **told)
    assert run.returncode == 1, run.stdout + run.stderr
    assert "Traceback" not in run.stderr
    assert f"pip install 'galley[{extra}]'" in run.stderr.strip().splitlines()[-1]


def test_f18_the_table_of_extras_is_that_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for library, extra in EXTRA_OF.items():
        wanted = " ".join(project["optional-dependencies"][extra]).lower().replace("-", "_")
        names = {"PIL": "pillow", "dask": "distributed"}
        assert names.get(library, library) in wanted
