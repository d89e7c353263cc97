"""A real PostgreSQL server for tests: started from the system's packages in a folder of its own."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

import psycopg

MISSING = "these tests start a PostgreSQL server; install it with: apt-get install postgresql"


def binaries() -> Path:
    """The folder of `initdb` and `pg_ctl`. Raises RuntimeError if PostgreSQL is not installed."""
    found = shutil.which("initdb")
    if found is not None:
        return Path(found).resolve().parent
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda p: int(p.parts[4]))
    if not folders:
        raise RuntimeError(MISSING)
    return folders[-1].parent


class Postgres:
    """One server on a Unix socket only. It does not sync to disk: quick, and safe against all but a crash."""

    def __init__(self, folder: Path) -> None:
        self._bin = binaries()
        self.data = folder / "data"
        self._folder = folder
        # PostgreSQL refuses to run as root.
        self._user: dict[str, Any] = {}
        if os.geteuid() == 0:
            names = {entry.pw_name for entry in pwd.getpwall()}
            user = pwd.getpwnam("postgres" if "postgres" in names else "nobody")
            os.chown(folder, user.pw_uid, user.pw_gid)
            self._user = {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}
        how = ("--no-sync", "--auth=trust", "--username=galley", "--encoding=UTF8", "--locale=C")
        self._run("initdb", "-D", str(self.data), *how)

    def _run(self, command: str, *arguments: str) -> None:
        done = subprocess.run(
            [self._bin / command, *arguments],
            cwd=self._folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE if command == "initdb" else subprocess.DEVNULL,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            **self._user,
        )
        if done.returncode != 0:
            log = self._folder / "log"
            told = log.read_text(errors="replace")[-2000:] if log.exists() else done.stdout
            raise RuntimeError(f"{command} failed: {told}")

    def start(self) -> None:
        """Returns once connections are taken."""
        settings = {
            "listen_addresses": "",
            "unix_socket_directories": str(self._folder),
            "fsync": "off",
            "shared_buffers": "16MB",
            "max_connections": "60",
            "autovacuum": "off",
        }
        options = " ".join(f"-c {name}='{value}'" for name, value in settings.items())
        log = str(self._folder / "log")
        self._run("pg_ctl", "-D", str(self.data), "-w", "-t", "60", "-l", log, "-o", options, "start")

    def stop(self, mode: str = "fast") -> None:
        """Returns once the server is gone; `fast` cuts every connection, `immediate` does not tidy up."""
        self._run("pg_ctl", "-D", str(self.data), "-w", "-t", "60", "-m", mode, "stop")

    def url(self, database: str) -> str:
        """What Galley is told with --database."""
        return f"postgresql://galley@/{database}?host={quote(str(self._folder), safe='')}"

    def execute(self, query: str, database: str = "postgres") -> list[tuple[Any, ...]]:
        """The rows of a query made by another program."""
        with psycopg.connect(
            host=str(self._folder), dbname=database, user="galley", autocommit=True
        ) as connection:
            cursor = connection.execute(query)  # type: ignore[call-overload]
            return cursor.fetchall() if cursor.description else []


@contextmanager
def running() -> Iterator[Postgres]:
    """A fresh server, removed at the end. Its folder has a short name: sockets allow no long one."""
    folder = Path(tempfile.mkdtemp(prefix="galley-pg-", dir="/tmp"))
    try:
        server = Postgres(folder)
        server.start()
        try:
            yield server
        finally:
            if (server.data / "postmaster.pid").exists():
                server.stop("immediate")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
