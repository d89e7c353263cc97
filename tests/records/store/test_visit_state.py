"""Where a visit stands, read at once."""

from __future__ import annotations

from galley.records import Store
from galley.records.store.visit_state import Attempt, VisitState, visit_state
from tests.records.helpers import START_MS, begin


def read(store: Store, token: str) -> VisitState | None:
    return store.read(lambda connection: visit_state(connection, token)).result()


def test_a_visit_stands_where_its_answers_and_attempts_put_it(store: Store) -> None:
    visit = begin(store)
    fresh = read(store, visit.token)
    assert fresh is not None
    assert (fresh.visit.id, fresh.answers, fresh.entered_ms, fresh.attempt) == (visit.id, {}, {}, None)
    store.enter_step(visit.id, "survey", START_MS + 5).result()
    store.enter_step(visit.id, "survey", START_MS + 50).result()
    store.save_answers(visit.id, "survey", {"age": 7}, 1, "active", START_MS + 60).result()
    store.enter_step(visit.id, "quiz", START_MS + 70).result()
    for attempt, answer in ((1, "a"), (2, "b")):
        store.save_attempt(visit.id, "quiz", attempt, {"q": answer}, START_MS + 80 + attempt).result()
    now = read(store, visit.token)
    assert now is not None
    assert now.answers == {"survey": {"age": 7}}
    assert now.entered_ms == {"survey": START_MS + 5, "quiz": START_MS + 70}
    assert now.attempt == Attempt("quiz", 2, {"q": "b"})
    assert now.visit.tries == 2


def test_an_unknown_token_stands_nowhere(store: Store) -> None:
    assert read(store, "nobody") is None
