"""The two kinds of database that every test of the records runs on."""

from __future__ import annotations

import itertools
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from galley.records import Store
from tests.postgres import Postgres

NUMBERS = itertools.count()
TEMPLATE = "galley_template"


@dataclass(frozen=True)
class Database:
    """A database of its own for one test."""

    url: str
    kind: str
    rows: Callable[[str], list[tuple[Any, ...]]]
    """What another program reads from it meanwhile."""


def sqlite(folder: Path) -> Database:
    """A file that does not exist yet."""
    file = folder / "deep" / "galley.sqlite"

    def rows(query: str) -> list[tuple[Any, ...]]:
        with closing(sqlite3.connect(file)) as connection:
            return connection.execute(query).fetchall()

    return Database(str(file), "sqlite", rows)


def empty_postgresql(server: Postgres) -> Database:
    """A database without tables."""
    return _made(server, "template0")


def postgresql(server: Postgres) -> Database:
    """A database that was migrated before: a copy of one, since that is quicker."""
    if not server.execute(f"SELECT 1 FROM pg_database WHERE datname = '{TEMPLATE}'"):
        server.execute(f"CREATE DATABASE {TEMPLATE}")
        Store.open(server.url(TEMPLATE)).close()
    return _made(server, TEMPLATE)


def drop(server: Postgres, database: Database) -> None:
    """Free its disk; each takes some 8 MB."""
    name = database.url.partition("@/")[2].partition("?")[0]
    server.execute(f"DROP DATABASE {name} WITH (FORCE)")


def _made(server: Postgres, template: str) -> Database:
    name = f"galley_{next(NUMBERS)}"
    server.execute(f"CREATE DATABASE {name} TEMPLATE {template}")
    return Database(server.url(name), "postgresql", lambda query: server.execute(query, name))
