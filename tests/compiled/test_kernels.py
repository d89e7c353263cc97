"""How the kernels are compiled: where the cache goes, what importing costs, and that plain Python will do."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

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


STEP = """
import galley.kitchen
print(galley.kitchen.__file__)
layout = galley.kitchen.Layout.from_ascii("l", "XPOX\\nX12X\\nXDSX")
print(galley.kitchen.Kitchen(layout).step(4, 4))
from galley.kitchen.rules import tick
print(tick.step.stats.cache_path)
"""


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A folder with a copy of the kitchen beside whose modules nobody, not even root, can keep a kernel."""
    galley_ = tmp_path / "readonly" / "galley"
    for package in ("kitchen", "compiled", "files"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(PACKAGE / package, galley_ / package, ignore=ignored)
    for file in ("__init__.py", "errors.py"):
        shutil.copy(PACKAGE / file, galley_)
    for package in {module.parent for module in galley_.rglob("*.py")}:
        (package / "__pycache__").write_text("a file in the way")
    return galley_.parent


def test_a_cache_folder_that_cannot_be_written_gives_way_to_the_users(copied: Path, tmp_path: Path) -> None:
    user = tmp_path / "user"
    user.mkdir()
    printed = run(STEP, copied, HOME=str(user), XDG_CACHE_HOME=str(user), PYTHONDONTWRITEBYTECODE="1")
    origin, reward, cache = printed.split()
    assert Path(origin).is_relative_to(copied)
    assert reward == "0"
    assert Path(cache).is_relative_to(user)
    assert list(Path(cache).glob("tick.step-*.nbi"))


@pytest.mark.parametrize("home", ["/dev/null", "no/folder"])
def test_an_account_without_a_home_keeps_kernels_where_only_it_can_write(
    copied: Path, tmp_path: Path, home: str
) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    where = {"HOME": home, "TMPDIR": str(temporary), "PYTHONDONTWRITEBYTECODE": "1"}
    code = "from galley.compiled.randomness import draw; draw(1, 0, 0, 0); print(draw.stats.cache_path)"
    cache = Path(run(code, copied, **where).strip())
    assert cache.is_relative_to(temporary)
    assert list(cache.glob("randomness.draw-*.nbi"))
    assert cache.parent.stat().st_mode & 0o777 == 0o700

    cache.parent.chmod(0o777)  # others could have put code there
    told = run(
        f"from galley.errors import GalleyError\ntry:\n    {code}\nexcept GalleyError as error: print(error)",
        copied,
        **where,
    )
    assert len(told.splitlines()) == 1
    assert str(cache.parent) in told
    assert "set NUMBA_CACHE_DIR to a folder that can be written" in told


CALLER = """
from galley.compiled.kernels import kernel
from galley.kitchen.codes import CHANGED
from galley.kitchen.callee import callee
from galley.kitchen import other

@kernel
def caller():
    return CHANGED * 100 + callee() * 10 + other.also()
"""
CALLEE = "from galley.compiled.kernels import kernel\n\n@kernel\ndef {}():\n    return {}\n"
CALL = "from galley.kitchen.caller import caller; print(caller(), sum(caller.stats.cache_hits.values()))"


def test_a_kernel_is_compiled_anew_when_what_it_is_made_of_changes_and_only_then(
    copied: Path, tmp_path: Path
) -> None:
    kitchen = copied / "galley" / "kitchen"
    codes = (kitchen / "codes.py").read_text()

    def called(constant: int, callee: int, other: int, unrelated: int = 0) -> tuple[int, ...]:
        """What the caller gives, and how many kernels of it came from the cache, after these changes."""
        (kitchen / "__init__.py").write_text("")
        (kitchen / "codes.py").write_text(f"{codes}\nCHANGED = {constant}\n")
        (kitchen / "callee.py").write_text(CALLEE.format("callee", callee))
        (kitchen / "other.py").write_text(CALLEE.format("also", other))
        (kitchen / "caller.py").write_text(CALLER)
        (kitchen / "layout.py").write_text(f"# {unrelated}")
        printed = run(CALL, copied, NUMBA_CACHE_DIR=str(tmp_path / "cache"), PYTHONDONTWRITEBYTECODE="1")
        return tuple(map(int, printed.split()))

    assert called(1, 2, 3) == (123, 0)
    assert called(1, 2, 3) == (123, 1), "writing the same again is no change"
    assert called(1, 2, 3, unrelated=1) == (123, 1), "nor is one elsewhere"
    assert called(4, 2, 3) == (423, 0), "a constant of another module"
    assert called(4, 5, 3) == (453, 0), "a function of another module"
    assert called(4, 5, 6) == (456, 0), "a module imported by name"
    assert called(4, 5, 6) == (456, 1)


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
        "starlette",
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
