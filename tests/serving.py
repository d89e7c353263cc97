"""Real `galley` commands in processes of their own, for tests that look at them from outside."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

START = [sys.executable, "-c", "from galley.cli import main; main()"]


def run_galley(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run one `galley` command to its end."""
    command = [*START, *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=240, check=False)


@dataclass(frozen=True)
class Server:
    """A server that is up: where it listens and what it has printed."""

    url: str
    process: subprocess.Popen[bytes]
    log: Path


@contextmanager
def served(
    workspace: Path, database: str, *options: str, environment: Mapping[str, str] | None = None
) -> Iterator[Server]:
    """Serve a workspace on a free port until the block ends."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        command = [*START, "serve", str(workspace), "--port", "0", "--database", database, *options]
        with log.open("wb") as out:
            process = subprocess.Popen(
                command, stdout=out, stderr=subprocess.STDOUT, env={**os.environ, **(environment or {})}
            )
        try:
            yield Server(_wait_until_up(process, log), process, log)
        finally:
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _wait_until_up(process: subprocess.Popen[bytes], log: Path) -> str:
    for _ in range(3000):
        found = re.search(r"http://[^\s/]+:(\d+)", log.read_text())
        if found and found[1] != "0":
            return found[0]
        if process.poll() is not None:
            break
        time.sleep(0.1)
    raise RuntimeError(f"the server did not come up:\n{log.read_text()}")
