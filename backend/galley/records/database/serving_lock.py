"""One serving process per SQLite file."""

from __future__ import annotations

from pathlib import Path

from galley.files.lock import FileLock


def serving_lock(database: Path) -> FileLock:
    """The lock by which one process serves an SQLite file.

    Raises:
        GalleyError: another process, or another store of this one, serves it.
    """
    return FileLock(
        database.with_name(database.name + "-serving"),
        f"{database}: process {{holder}} already serves this database; "
        "stop it, name another file with --database, or use PostgreSQL for several servers",
    )
