"""Connections to the database that a URL names, set so that what was acknowledged survives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sqlalchemy import Engine, Table, create_engine, event
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from galley.errors import GalleyError

BUSY_MS = 10_000
CONNECT_S = 5
POSTGRESQL = "postgresql+psycopg"
FORMS = "sqlite:///FILE or postgresql://HOST/NAME"


def database_url(database: str | Path) -> URL:
    """The URL that `database` means: a URL as it stands, or the path of an SQLite file.

    Raises:
        GalleyError: a database that Galley cannot keep records in.
    """
    text = str(database)
    if "://" not in text:
        return URL.create("sqlite", database=text)
    try:
        url = make_url(text)
        kind = url.get_backend_name()
    except ArgumentError:
        raise GalleyError(f"database {text!r} is not a URL; write {FORMS}") from None
    if kind in ("postgresql", "postgres"):
        return url.set(drivername=POSTGRESQL)
    if kind != "sqlite":
        raise GalleyError(f"database kind {kind!r} is not supported; use {FORMS}")
    if url.database in (None, "", ":memory:"):
        raise GalleyError("records need a file, not a database in memory; write sqlite:///FILE")
    return url


def sqlite_file(url: URL) -> Path | None:
    """The file behind an SQLite URL, None for a database server."""
    return Path(str(url.database)) if url.get_backend_name() == "sqlite" else None


def shown(url: URL) -> str:
    """What messages call the database: its file, or its URL without the password."""
    return str(sqlite_file(url) or url.set(drivername="postgresql").render_as_string())


def connect(url: URL, *, writes: bool, migrates: bool = False) -> Engine:
    """An engine on `url`; one that does not write refuses to, one that migrates may rebuild tables.

    Raises:
        GalleyError: the driver is missing.
    """
    try:
        if url.get_backend_name() == "sqlite":
            return _sqlite(url, writes, migrates)
        return create_engine(url, pool_pre_ping=True, connect_args={"connect_timeout": CONNECT_S})
    except ImportError as missing:
        fix = "pip install 'galley[postgres]'"
        raise GalleyError(f"database {shown(url)}: the driver is missing ({missing}); {fix}") from None


def _sqlite(url: URL, writes: bool, migrates: bool) -> Engine:
    engine = create_engine(url, connect_args={"timeout": BUSY_MS / 1000, "check_same_thread": False})

    @event.listens_for(engine, "connect")
    def prepare(connection: Any, _record: Any) -> None:
        # The driver opens transactions late by habit: that gives neither snapshots nor safe migrations.
        connection.isolation_level = None
        for pragma in (
            "journal_mode = WAL",
            "synchronous = FULL",
            # What is deleted is overwritten, so that an erased person is gone from the file as well.
            "secure_delete = ON",
            # A migration may rebuild a table; to drop the old one must not delete what points at it.
            f"foreign_keys = {'OFF' if migrates else 'ON'}",
            f"query_only = {'OFF' if writes else 'ON'}",
        ):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Any) -> None:
        # IMMEDIATE: a writer waits its turn at the start, where waiting is safe, not in the middle.
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def insert_into(engine: Engine, table: Table) -> Any:
    """An INSERT of this engine's dialect, the kind that knows what to do on a conflict."""
    return (sqlite if engine.dialect.name == "sqlite" else postgresql).insert(table)
