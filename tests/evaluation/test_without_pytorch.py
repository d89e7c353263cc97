"""Judging agents and drawing what came out need no PyTorch, as the help says."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GALLEY = """
import sys
for name in ("torch", "onnx", "tqdm", "tensorboard"):
    sys.modules[name] = None
from galley.cli import main
main()
"""


def galley(*words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", GALLEY, *words], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_agents_are_judged_and_drawn_without_pytorch(tmp_path: Path) -> None:
    kept = str(tmp_path / "scores.json")
    words = ["stay", "random", "--layout", "cramped_room", "--games", "2", "--out", kept]
    assert "2 games for each seat order" in galley("learn", "evaluate", *words)
    galley("learn", "plot", "bars", kept, "--partner", "stay", "--out", str(tmp_path / "bars.svg"))
    galley("learn", "plot", "graphs", kept, "--out", str(tmp_path / "graphs.svg"))
    (tmp_path / "log.csv").write_text("ticks,score\n1,2\n2,3\n")
    galley("learn", "plot", "curves", str(tmp_path), "--out", str(tmp_path / "curves.svg"))
    assert {path.name for path in tmp_path.glob("*.svg")} == {"bars.svg", "graphs.svg", "curves.svg"}
    assert "evaluate nothing more" in " ".join(galley("learn", "--help").replace("│", "").split())
