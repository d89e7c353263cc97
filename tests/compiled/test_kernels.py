"""How the kernels are compiled: where the cache goes, what importing costs, and that plain Python will do."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import galley

PACKAGE = Path(galley.__file__).parent


def run(code: str, folder: Path, **environment: str) -> str:
    """What a fresh Python prints for `code`, importing galley from `folder`."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA", "XDG"))}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=kept | {"PYTHONPATH": str(folder)} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_cache_folder_that_cannot_be_written_gives_way_to_the_users(tmp_path: Path) -> None:
    copied = tmp_path / "readonly"
    kitchen = copied / "galley" / "kitchen"
    ignored = shutil.ignore_patterns("__pycache__")
    kitchen.mkdir(parents=True)
    for file in ("__init__.py", "errors.py"):
        shutil.copy(PACKAGE / file, copied / "galley")
    shutil.copytree(PACKAGE / "kitchen", kitchen, dirs_exist_ok=True, ignore=ignored)
    (kitchen / "__pycache__").write_text(
        "a file in the way, so that nobody, not even root, can write below it"
    )
    code = """
import galley.kitchen
print(galley.kitchen.__file__)
layout = galley.kitchen.Layout.from_ascii("l", "XPOX\\nX12X\\nXDSX")
print(galley.kitchen.Kitchen(layout).step(4, 4))
from galley.kitchen import rules
print(rules.step.stats.cache_path)
"""
    user = tmp_path / "user"
    user.mkdir()
    printed = run(code, copied, HOME=str(user), XDG_CACHE_HOME=str(user), PYTHONDONTWRITEBYTECODE="1")
    origin, reward, cache = printed.split()
    assert Path(origin).is_relative_to(copied)
    assert reward == "0"
    assert Path(cache).is_relative_to(user)
    assert list(Path(cache).glob("rules.step-*.nbi"))


def test_the_kitchen_needs_numpy_and_numba_only() -> None:
    code = """
import sys, galley.kitchen, galley.datasets.overcooked_games, galley.kitchen.measures
print(*sorted({name.split(".")[0] for name in sys.modules}))
"""
    loaded = set(run(code, PACKAGE.parent).split())
    assert {"numpy", "numba"} <= loaded
    assert not loaded & {
        "pydantic",
        "ruamel",
        "pandas",
        "torch",
        "onnxruntime",
        "sqlalchemy",
        "fastapi",
        "typer",
    }


def test_without_the_compiler_all_is_the_same() -> None:
    code = """
import hashlib, numpy, numba
from galley.kitchen import ENCODINGS, Encoder, KitchenBatch, Layout, warm
warm()
layout = Layout.from_ascii("l", "XXPXX\\nO1 2S\\nX   X\\nXDPXX", cook_time_ticks=3, orders=("onion",) * 2)
batch = KitchenBatch(layout, 3)
random = numpy.random.default_rng(1)
digest = hashlib.sha256()
for tick in range(200):
    batch.step(random.choice([0, 1, 2, 3, 5, 5], (3, 2)))
    batch.reset(batch.done)
    digest.update(batch.states.tobytes() + batch.out.tobytes() + batch.shaping().tobytes())
    for name in ENCODINGS:
        digest.update(Encoder(layout, name).both(batch.states).tobytes() if tick % 20 == 0 else b"")
print(numba.config.DISABLE_JIT, digest.hexdigest())
"""
    compiled = run(code, PACKAGE.parent).split()
    plain = run(code, PACKAGE.parent, NUMBA_DISABLE_JIT="1").split()
    assert (int(compiled[0]), int(plain[0])) == (0, 1)
    assert compiled[1] == plain[1]
