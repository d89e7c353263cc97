"""`galley learn train` and `export` as people use them: wrong wishes, a killed run, an agent that plays."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from typer.testing import CliRunner

from galley.agents.catalogue import Catalogue
from galley.cli import app
from galley.errors import GalleyError
from galley.evaluation.game_graph import PayoffTable
from galley.files.lock import FileLock
from galley.kitchen.layout_file import load_layout
from galley.learning.bundles.from_runs import export
from galley.learning.bundles.training_card import command
from galley.learning.checkpoint_payoffs import checkpoint_payoffs
from galley.learning.methods.table import METHODS
from galley.learning.options import TrainingOptions, parsed_changes
from galley.learning.policy_files import self_play_milestones
from galley.learning.ppo.learner import Learner
from galley.learning.run_settings import response_settings, run_description
from galley.learning.training_run import TrainingFolder, make_training
from galley.workspace import Workspace
from tests.learning.kitchens import CPU, QUICK

ROOT = Path(__file__).resolve().parents[2]
TINY = """\
format: 1
title: Tiny
source: made up
rules: {cook_time_ticks: 3, delivery_reward: 20, horizon_ticks: 20}
grid: |
  XXPXX
  O1  O
  X  2X
  XDXSX
"""
SMALL_RUN = ("--quick", "--set", "ticks=160", "--set", "minibatches=2", "--threads", "1")


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    for name in ("studies", "questionnaires", "agents"):
        (tmp_path / name).mkdir()
    shutil.copytree(ROOT / "layouts", tmp_path / "layouts")
    shutil.copytree(ROOT / "agents" / "human-bc", tmp_path / "agents" / "human-bc")
    (tmp_path / "layouts" / "tiny.yaml").write_text(TINY)
    return tmp_path


def train(workspace: Path, *words: str) -> Path:
    """The folder of a small run that was trained by the command line in this process."""
    result = CliRunner().invoke(
        app, ["learn", "train", *words, *SMALL_RUN, "--workspace", str(workspace)], catch_exceptions=False
    )
    assert result.exit_code == 0, result.output
    return workspace / "runs" / f"{words[0]}-tiny-0"


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (TrainingOptions("spp", "tiny"), "method 'spp' is unknown"),
        (
            TrainingOptions("cole-sv", "tiny", ratio="4:0"),
            "ratio '4:0' is unknown; use one of 0:4 1:3 2:2 3:1",
        ),
        (TrainingOptions("sp", "tiny", scale=0), "scale is 0; use a number above 0"),
        (TrainingOptions("sp", "tiny", device="tpu"), "device 'tpu' is unknown; use cpu or cuda"),
        (TrainingOptions("mep", "tiny", population=1), "population is 1; use 2 to 64"),
        (TrainingOptions("sp", "tiny", changes=(("clip", -1.0),)), "clip is -1"),
        (TrainingOptions("pbt", "tiny", pool=("runs/x",)), "--pool gives FCP and COLE a population"),
        (TrainingOptions("fcp", "tiny", pool=("runs/absent",)), "runs/absent: is no run"),
        (TrainingOptions("cole-sv", "tiny", changes=(("ticks", 20.0),)), "too few for ratio"),
    ],
)
def test_wrong_options_are_told_before_anything_is_trained(
    workspace: Path, options: TrainingOptions, told: str
) -> None:
    layout = load_layout(workspace / "layouts" / "tiny.yaml")
    with pytest.raises(GalleyError) as raised:
        make_training(options, layout)
    assert told in str(raised.value)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU here")
def test_a_gpu_that_is_not_there_is_told(workspace: Path) -> None:
    with pytest.raises(GalleyError, match="finds no CUDA GPU here; use --device cpu"):
        make_training(
            TrainingOptions("sp", "tiny", device="cuda"), load_layout(workspace / "layouts" / "tiny.yaml")
        )


def test_unknown_layouts_and_constants_are_told(workspace: Path) -> None:
    result = CliRunner().invoke(
        app, ["learn", "train", "sp", "--layout", "tinny", "--workspace", str(workspace)]
    )
    assert "tinny" in str(result.exception)
    assert "tiny" in str(result.exception)
    with pytest.raises(GalleyError, match="constant 'clup' is unknown"):
        parsed_changes(["clup=1"])
    with pytest.raises(GalleyError, match="'much' is no number"):
        parsed_changes(["clip=much"])


def test_published_constants_are_the_defaults(workspace: Path) -> None:
    told = run_description(TrainingOptions("cole-sv", "counter_circuit"))
    assert told["ppo"] | {"learning_rate": 8e-4, "clip": 0.05, "epochs": 8, "ticks": 48_000} == told["ppo"]
    assert (told["cole"]["generations"], told["cole"]["updates"], told["cole"]["cap"]) == (70, 10, 50)
    assert METHODS["cole-sv"].source_ticks("counter_circuit") == 70 * 10 * 48_000
    assert run_description(TrainingOptions("sp", "cramped_room"))["ppo"]["minibatches"] == 6


def test_a_best_response_is_paid_for_its_own_deeds_unless_asked_otherwise() -> None:
    asked = TrainingOptions("fcp", "cramped_room", quick=True, scale=0.1, response=4)
    found = response_settings(asked)
    assert (found.partner_shaping, found.lambda_) == (0.0, 0.9)
    assert found.shaping_ticks == pytest.approx(0.9 * 4 * 0.1 * 6e6)
    assert (
        make_training(asked, load_layout(ROOT / "layouts" / "cramped_room.yaml")).response.learner.settings
        == found
    )
    changes = (("partner_shaping", 0.5), ("shaping_ticks", 7.0))
    changed = response_settings(replace(asked, changes=changes))
    assert (changed.partner_shaping, changed.lambda_) == (0.5, 0.9)
    assert changed.shaping_ticks == found.shaping_ticks  # what was asked for is the population's
    changed = response_settings(replace(asked, changes=changes, pool=("runs/sp-ring-0",)))
    assert (changed.partner_shaping, changed.shaping_ticks) == (0.5, 7.0)


def test_runs_become_an_agent_with_a_card(workspace: Path) -> None:
    run = train(workspace, "sp", "--layout", "tiny", "--scale", "0.00004")
    assert {path.name for path in (run / "members").iterdir()} == {
        "0025.pt", "0050.pt", "best.pt", "early.pt", "final.pt", "half.pt",
    }  # fmt: skip
    table = checkpoint_payoffs(workspace, run, games=2)
    assert table.names == ["0025", "0050"]
    assert table.games.tolist() == [[2, 2], [2, 2]]
    assert PayoffTable.load(run / "payoffs.npz").names == table.names
    begun = json.loads((run / "run.json").read_text())
    (run / "run.json").write_text(json.dumps(begun | {"processor": "Another Machine"}))
    bundle = export(workspace, [run], "newcomer")
    assert Catalogue(Workspace(workspace)).bundle("newcomer").sha256 == bundle.sha256
    card = (bundle.path / "card.md").read_text()
    assert "galley learn train sp --layout tiny --seed 0 --quick --scale 4e-05" in card
    assert f"Another Machine, 1 | 0 | {torch.__version__} |" in card
    facts = json.loads((bundle.path / "training.json").read_text())
    assert facts["tiny"]["ticks"] == 320
    assert facts["tiny"]["scores"]["itself"][2] == 100
    halfway = export(workspace, [run], "halfway", member="0025")
    assert halfway.sha256 != bundle.sha256
    assert "| tiny, member 0025 | 320 |" in (halfway.path / "card.md").read_text()
    with pytest.raises(GalleyError, match="has no member '0052'"):
        export(workspace, [run], "absent", member="0052")
    again = train(workspace, "fcp", "--layout", "tiny", "--scale", "0.00002", "--pool", str(run))
    assert "--pool" in command(json.loads((again / "run.json").read_text()))
    assert "--response" not in command(json.loads((again / "run.json").read_text()))
    assert "--response 3" in command(run_description(TrainingOptions("mep", "tiny", response=3)))
    response = export(workspace, [again], "response").path
    assert "galley learn train sp --layout tiny --seed 0" in (response / "card.md").read_text()
    facts = json.loads((response / "training.json").read_text())
    assert facts["tiny"]["ticks"] > 320
    with pytest.raises(GalleyError, match="one method, not fcp and sp"):
        export(workspace, [run, again], "both")
    with pytest.raises(GalleyError, match="of one layout"):
        export(workspace, [run, run], "twice")


def test_only_finished_runs_of_self_play_make_a_pool(workspace: Path, tmp_path: Path) -> None:
    layout = load_layout(workspace / "layouts" / "tiny.yaml")
    run = train(workspace, "sp", "--layout", "tiny", "--scale", "0.00002")
    assert list(self_play_milestones([str(run)], layout, CPU.device)) == [
        f"sp-tiny-0-{stage}" for stage in ("early", "half", "final")
    ]
    other = load_layout(workspace / "layouts" / "cramped_room.yaml")
    with pytest.raises(GalleyError, match="finished runs of sp on cramped_room"):
        self_play_milestones([str(run)], other, CPU.device)
    TrainingFolder(tmp_path / "begun", {"method": "sp", "layout": "tiny"})
    with pytest.raises(GalleyError, match="is not finished"):
        export(workspace, [tmp_path / "begun"], "early")


def test_two_processes_do_not_train_in_one_folder(workspace: Path) -> None:
    run = train(workspace, "sp", "--layout", "tiny", "--scale", "0.00002")
    with FileLock(run / "lock", "unused"), pytest.raises(GalleyError, match="another process trains here"):
        train(workspace, "sp", "--layout", "tiny", "--scale", "0.00002")


def test_the_same_command_goes_on_after_kill_9(workspace: Path) -> None:
    galley = str(Path(sys.executable).with_name("galley"))
    words = ["cole-sv", "--layout", "tiny", "--generations", "12", "--generation-updates", "2", *SMALL_RUN]

    def start(out: Path) -> subprocess.Popen[bytes]:
        return subprocess.Popen([galley, "learn", "train", *words, "--out", str(out)], cwd=workspace)

    whole, broken = workspace / "whole", workspace / "broken"
    assert start(whole).wait() == 0
    process = start(broken)
    while not (broken / "members" / "0003.pt").is_file() and process.poll() is None:
        time.sleep(0.005)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    assert not (broken / "members" / "best.pt").is_file()
    assert start(broken).wait() == 0
    for name in sorted(path.name for path in (whole / "members").iterdir()):
        one, other = (torch.load(folder / "members" / name) for folder in (whole, broken))
        assert all(torch.equal(one[key], other[key]) for key in one), name


def test_a_learner_knows_how_far_it_is(workspace: Path) -> None:
    learner = Learner(load_layout(workspace / "layouts" / "tiny.yaml"), QUICK, 4, 0, CPU)
    assert (learner.progress, learner.ticks) == (0.0, 0)
    learner.done = 3
    assert (learner.progress, learner.ticks) == (0.75, 3 * QUICK.ticks)
