"""Databases for the tests of the records."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from galley.records import Store
from tests import postgres
from tests.records import databases
from tests.records.databases import Database


@pytest.fixture(scope="session")
def postgresql_server() -> Iterator[postgres.Postgres]:
    """One server for all tests of a run."""
    with postgres.running() as server:
        yield server


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """Each test that asks for this runs on both kinds."""
    if request.param == "sqlite":
        yield databases.sqlite(tmp_path)
        return
    server = request.getfixturevalue("postgresql_server")
    made = databases.postgresql(server)
    yield made
    databases.drop(server, made)


@pytest.fixture
def store(database: Database) -> Iterator[Store]:
    """A serving store on either kind of database."""
    with Store.open(database.url, serving=True) as opened:
        yield opened
