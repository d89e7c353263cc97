"""Health from what waits, not from the last error only (A5)."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import text

from galley.records import Store
from galley.records.database import writer
from galley.records.store import store_base


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    monkeypatch.setattr(writer, "STALE_S", 0.2)
    monkeypatch.setattr(store_base, "STALE_S", 0.2)
    with Store.open(tmp_path / "records.sqlite", serving=True) as opened:
        yield opened


def test_a5_a_write_that_waits_is_a_matter_of_health(store: Store) -> None:
    """A frozen database answers nothing and raises nothing; those behind it wait too."""
    free = threading.Event()
    stuck = store.write(lambda _connection: free.wait(20))
    behind = store.write(lambda _connection: None)
    assert store.health().ok
    free.wait(0.4)
    health = store.health()
    assert (health.ok, health.message[:22]) == (False, "a write has waited for")
    free.set()
    stuck.result()
    behind.result()
    store.flush().result()
    assert store.health().ok


def test_a5_a_question_that_waits_is_a_matter_of_health(store: Store) -> None:
    """A locked table: readers wait, and the probe of the health check with them."""
    free = threading.Event()
    stuck = [store.read(lambda _connection: free.wait(20)) for _ in range(store_base.READERS)]
    store.probe()
    free.wait(0.4)
    assert store.health().message.startswith("a question has waited")
    free.set()
    for one in stuck:
        one.result()
    store.read(lambda _connection: None).result()
    free.clear()
    free.wait(0.05)
    assert store.health().ok


def test_a5_a_corrupt_table_is_a_matter_of_health(store: Store) -> None:
    """A question that the database refuses counts for a while; one that is wrong in our code does not."""
    with pytest.raises(Exception, match="no such table"):
        store.read(lambda connection: connection.execute(text("select * from gone"))).result()
    assert "no such table" in store.health().message
    threading.Event().wait(0.3)
    assert store.health().ok
    with pytest.raises(ZeroDivisionError):
        store.read(lambda _connection: 1 // 0).result()
    assert store.health().ok


def test_a5_a_writing_thread_that_ended_is_a_matter_of_health(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sibling: a thread that died raises nothing either."""
    thread = store._writer._thread
    monkeypatch.setattr(thread, "is_alive", lambda: False)
    assert store.health().message == "the writing thread has ended"


def test_a5_an_idle_store_is_well(store: Store) -> None:
    for _ in range(3):
        store.probe()
        threading.Event().wait(0.25)
        assert store.health().ok
