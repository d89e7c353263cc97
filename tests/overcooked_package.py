"""The `overcooked-ai` 1.1.0 package from PyPI, as data and as a peer to compare with, never a dependency.

Run as a script it prints the folder of the human games: `python tests/overcooked_package.py`.
"""

from __future__ import annotations

import importlib
import subprocess
import sys
import tarfile
import tempfile
import types
import warnings
from pathlib import Path
from typing import Any

CACHE = Path(__file__).resolve().parents[1] / ".cache" / "overcooked-ai"
RELEASE = "overcooked_ai-1.1.0"


def source() -> Path:
    """The folder that holds `overcooked_ai_py`; fetched from PyPI the first time, then kept in `.cache/`."""
    folder = CACHE / RELEASE / "src"
    if not folder.is_dir():
        CACHE.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=CACHE) as scratch:
            pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
            wanted = ["overcooked-ai==1.1.0", "--no-deps", "--no-binary", ":all:", "--dest", scratch]
            subprocess.run([*pip, *wanted], check=True)
            with tarfile.open(Path(scratch) / f"{RELEASE}.tar.gz") as archive:
                archive.extractall(scratch, filter="data")
            (Path(scratch) / RELEASE).rename(CACHE / RELEASE)
    return folder


def human_games_folder() -> Path:
    """The folder of `clean_train_trials.pickle` and `clean_test_trials.pickle`."""
    return source() / "overcooked_ai_py" / "data" / "human_data"


def mdp() -> Any:
    """The package's rules and encodings, imported without running the package's start, which wants gym."""
    name = "overcooked_ai_py"
    if name not in sys.modules:
        package = types.ModuleType(name)
        package.__path__ = [str(source() / name)]
        sys.modules[name] = package
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module(f"{name}.mdp.overcooked_mdp")


if __name__ == "__main__":
    print(human_games_folder())
