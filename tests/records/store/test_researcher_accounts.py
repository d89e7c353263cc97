"""Accounts and sessions of researchers."""

from __future__ import annotations

from galley.records import Store
from galley.records.store.researcher_accounts import Researchers
from tests.records.databases import Database
from tests.records.helpers import START_MS


def test_an_account_is_made_found_changed_and_removed(store: Store) -> None:
    desk = Researchers(store)
    assert desk.all().result() == ()
    ada = desk.put("ada", "scrypt$1", START_MS).result()
    bob = desk.put("bob", "scrypt$2", START_MS + 1).result()
    assert desk.find("ada").result() == ada
    assert desk.find("eve").result() is None
    changed = desk.put("ada", "scrypt$3", START_MS + 2).result()
    assert (changed.id, changed.password_hash, changed.created_ms) == (ada.id, "scrypt$3", START_MS)
    assert desk.all().result() == (changed, bob)
    assert "scrypt" not in repr(changed)
    assert desk.remove("ada").result() is True
    assert desk.remove("ada").result() is False
    assert desk.all().result() == (bob,)


def test_a_session_lasts_until_it_is_closed_or_runs_out(store: Store, database: Database) -> None:
    desk = Researchers(store)
    ada = desk.put("ada", "scrypt$1", START_MS).result()
    token, other = (desk.open_session(ada.id, START_MS, START_MS + 1000).result() for _ in range(2))
    found = desk.session(token, START_MS + 999).result()
    assert found is not None
    assert (found.researcher, found.expires_ms) == (ada, START_MS + 1000)
    assert len(found.csrf) >= 32
    assert found.csrf not in repr(found)
    assert desk.session(token, START_MS + 1000).result() is None
    assert desk.session("guess", START_MS).result() is None
    assert database.rows(f"SELECT count(*) FROM sessions WHERE token_sha256 = '{token}'") == [(0,)]
    assert desk.close_session(token).result() is True
    assert desk.session(token, START_MS).result() is None
    assert desk.session(other, START_MS).result() is not None
    assert desk.close_session(other).result() is True
    desk.open_session(ada.id, START_MS, START_MS + 10).result()
    desk.open_session(ada.id, START_MS + 500, START_MS + 1000).result()
    assert database.rows("SELECT count(*) FROM sessions") == [(1,)], "what ran out is cleared away"


def test_a_new_password_and_a_lost_account_end_every_session(store: Store) -> None:
    desk = Researchers(store)
    ada = desk.put("ada", "scrypt$1", START_MS).result()
    first = desk.open_session(ada.id, START_MS, START_MS + 1000).result()
    desk.put("ada", "scrypt$2", START_MS).result()
    assert desk.session(first, START_MS).result() is None
    second = desk.open_session(ada.id, START_MS, START_MS + 1000).result()
    desk.remove("ada").result()
    assert desk.session(second, START_MS).result() is None
