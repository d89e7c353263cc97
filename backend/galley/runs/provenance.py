"""What a run is made with: source, libraries and processor."""

from __future__ import annotations

import platform
import subprocess
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def provenance(libraries: Mapping[str, str] | None = None, accelerator: str = "") -> dict[str, str]:
    """Commit, version of Galley, `libraries` with theirs, and processor; "" for what cannot be known."""
    return {
        "commit": _commit(),
        "galley": _version("galley"),
        **(libraries or {}),
        "processor": f"{accelerator} and {_processor()}" if accelerator else _processor(),
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _commit() -> str:
    """The commit of this source, or nothing outside a checkout."""
    try:
        found = subprocess.run(
            ["git", "rev-parse", "--short=12", "HEAD"],  # noqa: S607
            cwd=Path(__file__).parent, capture_output=True, text=True, check=True,
        )  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        return ""
    return found.stdout.strip()
