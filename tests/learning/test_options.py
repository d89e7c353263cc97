"""One table of methods and one of options, which the command line, cards and docs follow."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from galley.cli import app
from galley.learning import training_run
from galley.learning.methods.table import METHODS
from galley.learning.options import TrainingOptions, train_command
from galley.learning.run_settings import run_description

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    "options",
    [
        TrainingOptions("sp", "cramped_room", seed=3, quick=True, scale=0.5, threads=2),
        TrainingOptions(
            "cole-r", "cramped_room", ratio="2:2", weighted=False, exploration=0.0, partners=6, generations=9,
            generation_updates=2, pool=("runs/one", "runs/two"), device="cuda",
        ),
        TrainingOptions(
            "mep", "cramped_room", population=4, response=1.5, changes=(("clip", 0.1), ("ticks", 800.0)),
            bf16=True,
        ),
    ],
    ids=lambda options: options.method,
)  # fmt: skip
def test_the_command_of_a_run_asks_for_the_same_run(
    options: TrainingOptions, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked = []
    monkeypatch.setattr(training_run, "train_run", lambda options, layout, path: asked.append(options))
    words = train_command(json.loads(json.dumps(run_description(options)))).split()[1:]
    result = CliRunner().invoke(app, [*words, "--workspace", str(ROOT), "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert asked == [options]


@pytest.mark.parametrize("agent", ["cole-r", "cole-sv", "fcp", "mep", "pbt", "sp"])
def test_shipped_cards_are_those_of_their_facts(agent: str) -> None:
    from galley.learning.bundles.training_card import training_card

    folder = ROOT / "agents" / agent
    facts = json.loads((folder / "training.json").read_text("utf-8"))
    assert training_card(agent, facts, None) == (folder / "card.md").read_text("utf-8")


def test_docs_name_every_method_with_its_source() -> None:
    text = (ROOT / "docs" / "learning.md").read_text("utf-8")
    section = text.partition("## Methods")[2].partition("##")[0]
    rows = [line for line in section.splitlines() if line.startswith("| `")]
    for name, method in METHODS.items():
        (row,) = [row for row in rows if f"`{name}`" in row.split("|")[1]]
        assert method.title.split()[0].lower() in row.lower()
        for source in method.source.split("; "):
            assert source.partition(" (")[0].partition(" paper")[0].replace(" et al.", "").split()[0] in row
