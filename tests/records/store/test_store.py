"""The store as the server uses it, on either kind of database."""

from __future__ import annotations

import asyncio
import json
import sqlite3
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import event, text
from sqlalchemy.exc import DBAPIError

from galley.errors import GalleyError
from galley.records import ClockRow, KeyRow, PauseRow, Store
from galley.records.store import queries
from galley.study.written.questionnaire import Questionnaire
from tests.records.databases import Database
from tests.records.helpers import START_MS, begin, joint_actions, one_soup, open_round, play, tick_rows
from tests.records.stored import stored_visit


def test_a_visit_is_found_by_its_token_alone(store: Store) -> None:
    visit = begin(store, PROLIFIC_PID="abc")
    other = begin(store)
    assert stored_visit(store, visit.token) == visit
    assert visit.seed == 2**64 - 1
    assert visit.condition == {"arm": "a"}
    assert visit.link_params == {"PROLIFIC_PID": "abc"}
    assert (visit.status, visit.step_index, visit.completion_code) == ("active", 0, None)
    assert visit.token != other.token
    assert visit.participant != other.participant
    assert len(visit.token) >= 32
    assert visit.participant not in visit.token
    assert stored_visit(store, "no such token") is None


def test_visit_numbers_are_never_given_out_twice(store: Store, database: Database) -> None:
    with ThreadPoolExecutor(8) as pool:
        numbers = list(pool.map(lambda _: begin(store).visit_no, range(40)))
    assert sorted(numbers) == list(range(40))
    assert begin(store, "other").visit_no == 0
    store.close()
    with Store.open(database.url) as again:
        assert begin(again).visit_no == 40


def test_answers_are_in_the_file_once_acknowledged(store: Store, database: Database) -> None:
    visit = begin(store)
    answers = {"ease": 5, "why": "=cmd()", "which": ["a", "b"], "left_out": None}
    assert store.save_answers(visit.id, "survey", answers, 1, "active", START_MS + 9).result()
    stored = database.rows("SELECT item, value, position FROM responses ORDER BY position")
    assert stored == [
        ("ease", "5", 1),
        ("why", '"=cmd()"', 2),
        ("which", '["a", "b"]', 3),
        ("left_out", "null", 4),
    ]
    after = stored_visit(store, visit.token)
    assert after is not None
    assert (after.step_index, after.status, after.ended_ms) == (1, "active", None)


def test_the_same_form_sent_twice_counts_once(store: Store, database: Database) -> None:
    visit = begin(store)
    store.enter_step(visit.id, "survey", START_MS).result()
    store.enter_step(visit.id, "survey", START_MS + 5).result()
    assert store.save_answers(visit.id, "survey", {"ease": 5}, 1, "active", START_MS + 9).result() is True
    assert store.save_answers(visit.id, "survey", {"ease": 1}, 1, "active", START_MS + 10).result() is False
    assert database.rows("SELECT value FROM responses") == [("5",)]
    assert database.rows("SELECT entered_ms, left_ms, views FROM stages") == [(START_MS, START_MS + 9, 2)]


def test_the_last_step_ends_the_visit_with_its_code(store: Store) -> None:
    visit = begin(store)
    store.save_answers(visit.id, "compare", {}, 6, "completed", START_MS + 9, completion_code="DONE").result()
    after = stored_visit(store, visit.token)
    assert after is not None
    assert (after.status, after.completion_code, after.ended_ms) == ("completed", "DONE", START_MS + 9)


def test_items_are_kept_as_they_were_shown(store: Store, database: Database) -> None:
    visit = begin(store)
    item = {
        "id": "ease",
        "kind": "likert",
        "text": "Easy?",
        "scale": 7,
        "low_label": "no",
        "high_label": "yes",
    }
    asked = Questionnaire.model_validate({"format": 1, "title": "T", "source": "S", "items": (item,)})
    store.save_answers(visit.id, "survey", {"ease": 5}, 1, "active", START_MS, questionnaire=asked).result()
    ((shown,),) = database.rows("SELECT shown FROM responses")
    assert (json.loads(shown)["text"], json.loads(shown)["scale"]) == ("Easy?", 7)


def test_a_round_is_set_up_once_per_step(store: Store) -> None:
    visit, other = begin(store), begin(store)
    first = open_round(store, visit)
    assert open_round(store, visit) == first
    assert len({first, open_round(store, visit, "rounds-2"), open_round(store, other)}) == 3


def test_a_round_of_an_unknown_visit_is_refused(store: Store) -> None:
    visit = begin(store)
    nobody = type(visit)(**{name: getattr(visit, name) for name in visit.__slots__} | {"id": 99})
    with pytest.raises(GalleyError, match="no visit 99"):
        open_round(store, nobody)


def test_an_open_round_comes_back_with_all_that_was_journalled(store: Store) -> None:
    visit = begin(store)
    assert store.open_round(visit.id, "rounds-1").result() is None
    round_id = open_round(store, visit)
    actions = joint_actions(1, 25)
    for tick, row in enumerate(tick_rows(actions)):
        store.journal(round_id, [row])
        if tick == 11:
            store.flush().result()
    row = store.open_round(visit.id, "rounds-1").result()
    assert row is not None
    assert row.id == round_id
    assert row.status == "open"
    assert row.joint_actions.dtype == np.uint8
    assert row.joint_actions.tolist() == [list(pair) for pair in actions]
    assert row.human.visit_id == visit.id
    assert row.human.seat == 1
    assert row.partner.agent == "chef-a"
    assert row.partner.hat == "orange"
    assert row.seed == 2**63 + 5


def test_a_tick_written_twice_is_the_same_tick(store: Store, database: Database) -> None:
    round_id = open_round(store, begin(store))
    ticks = tick_rows(joint_actions(1, 5))
    keys = [KeyRow(1, "up", True, 1.25, START_MS + 3.5, 0, 1)]
    pings = [ClockRow(1.0, 2.0, 30.0, 1)]
    for _ in range(2):
        store.journal(round_id, ticks, keys, [], pings)
        store.journal(round_id, ticks[2:], keys, [], pings)
        store.flush().result()
    assert store.health().ok
    assert database.rows("SELECT count(*), max(tick) FROM ticks") == [(5, 4)]
    assert database.rows("SELECT count(*) FROM keys") == [(1,)]
    assert database.rows("SELECT count(*) FROM clocks") == [(1,)]


def test_any_number_of_rows_of_many_rounds_is_written_in_one_go(store: Store, database: Database) -> None:
    rounds = {open_round(store, begin(store)): count for count in (1, 2, 255, 256, 257, 700)}
    for number, (round_id, count) in enumerate(rounds.items()):
        ticks = tick_rows(joint_actions(number, count))
        faulty = [row._replace(decision_ms=None, late=True, fault="error") for row in ticks[:1]]
        keys = [KeyRow(seq, "up", seq % 2 == 0, 1.0, START_MS + seq, None, 1) for seq in range(count)]
        pings = [ClockRow(1.0 * n, START_MS + n, None if n % 2 else 30.0, 0) for n in range(count)]
        store.journal(round_id, [*faulty, *ticks[1:]], keys, [], pings)
    store.flush().result()
    assert store.health().ok
    for number, (round_id, count) in enumerate(rounds.items()):
        here = f"WHERE round_id = {round_id}"
        found = database.rows(f"SELECT tick, action_0, action_1 FROM ticks {here} ORDER BY tick")
        wanted = joint_actions(number, count)
        assert found == [(tick, *pair) for tick, pair in enumerate(wanted)]
        told = "SELECT tick, deadline_ms, lateness_ms, decision_ms, late, fault"
        assert (
            database.rows(f"{told} FROM ticks {here} ORDER BY tick")[:2]
            == [
                (0, START_MS, 0.5, None, True, "error"),
                (1, START_MS + 50.0, 0.5, 3.25, False, None),
            ][:count]
        )
        told = "SELECT seq, key, down, client_ms, arrival_ms, tick_applied, seat"
        assert database.rows(f"{told} FROM keys {here} ORDER BY seq") == [
            (seq, "up", seq % 2 == 0, 1.0, START_MS + seq, None, 1) for seq in range(count)
        ]
        told = "SELECT client_ms, server_ms, rtt_ms, seat"
        assert database.rows(f"{told} FROM clocks {here} ORDER BY server_ms") == [
            (1.0 * n, START_MS + n, None if n % 2 else 30.0, 0) for n in range(count)
        ]


def test_a_page_that_was_reloaded_counts_its_keys_anew(store: Store, database: Database) -> None:
    round_id = open_round(store, begin(store))
    for arrival in (START_MS + 1.0, START_MS + 900.0):
        store.journal(round_id, keys=[KeyRow(1, "up", True, 1.0, arrival, 0, 1)])
    store.flush().result()
    assert database.rows("SELECT count(*) FROM keys") == [(2,)]


def test_a_pause_learns_its_end_and_keeps_it(store: Store, database: Database) -> None:
    round_id = open_round(store, begin(store))
    began = PauseRow(7, START_MS + 1.5, None, "left")
    over = PauseRow(7, START_MS + 1.5, START_MS + 99.0, "left")
    store.journal(round_id, pauses=[began])
    store.flush().result()
    assert database.rows("SELECT ended_ms FROM pauses") == [(None,)]
    store.journal(round_id, pauses=[over, began])
    store.flush().result()
    assert database.rows("SELECT started_ms, ended_ms FROM pauses") == [(START_MS + 1.5, START_MS + 99.0)]


def test_finishing_a_round_writes_the_rest_of_its_journal(store: Store, database: Database) -> None:
    visit = begin(store)
    round_id = open_round(store, visit)
    kitchen = play(store, round_id, one_soup())
    assert kitchen.score == 20
    assert database.rows("SELECT count(*) FROM ticks") == [(40,)]
    assert database.rows("SELECT status, score, deliveries FROM rounds") == [("finished", 20, 1)]
    assert store.finish_round(round_id, "abandoned", 0, 0, START_MS, b"").result() is False
    assert database.rows("SELECT status, score, deliveries FROM rounds") == [("finished", 20, 1)]


def test_futures_can_be_awaited_and_outlive_a_request_that_was_given_up(
    store: Store, database: Database
) -> None:
    visit = begin(store)

    async def leave_at_once() -> None:
        waiting = asyncio.wrap_future(
            store.save_answers(visit.id, "survey", {"ease": 5}, 1, "active", START_MS)
        )
        waiting.cancel()
        again = await asyncio.wrap_future(
            store.read(lambda connection: queries.visit(connection, visit.token))
        )
        assert again is not None

    asyncio.run(leave_at_once())
    store.flush().result()
    assert database.rows("SELECT value FROM responses") == [("5",)]


def test_the_journal_reaches_the_file_by_itself(store: Store, database: Database) -> None:
    round_id = open_round(store, begin(store))
    store.journal(round_id, tick_rows(joint_actions(1, 3)))
    patience = time.monotonic() + 20
    while not database.rows("SELECT count(*) FROM ticks")[0][0] and time.monotonic() < patience:
        time.sleep(0.02)
    assert database.rows("SELECT count(*) FROM ticks") == [(3,)]


def test_many_ticks_make_few_transactions(database: Database) -> None:
    commits = []
    with Store.open(database.url, flush_every_s=600) as store:
        event.listen(store._engine, "commit", commits.append)
        round_id = open_round(store, begin(store))
        commits.clear()
        for row in tick_rows(joint_actions(1, 300)):
            store.journal(round_id, [row])
        store.flush().result()
    assert len(commits) == 1


def test_closing_writes_what_waits_and_refuses_more(database: Database) -> None:
    store = Store.open(database.url, flush_every_s=600)
    round_id = open_round(store, begin(store))
    store.journal(round_id, tick_rows(joint_actions(1, 3)))
    store.close()
    store.close()
    assert database.rows("SELECT count(*) FROM ticks") == [(3,)]
    with pytest.raises(GalleyError, match="closed"):
        store.journal(round_id, tick_rows(joint_actions(1, 3)))
    with pytest.raises(GalleyError, match="closed"):
        begin(store)


def test_what_is_acknowledged_is_synced(store: Store) -> None:
    with store._engine.connect() as connection:
        if connection.dialect.name == "postgresql":
            assert connection.exec_driver_sql("SHOW synchronous_commit").scalar() == "on"
            return
        full = 2
        assert connection.exec_driver_sql("PRAGMA synchronous").scalar() == full
        assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
        assert connection.exec_driver_sql("PRAGMA foreign_keys").scalar() == 1


def test_readers_see_one_moment_and_cannot_write(store: Store) -> None:
    begin(store)
    with store.reading() as connection:
        count = text("SELECT count(*) FROM visits")
        assert connection.execute(count).scalar() == 1
        begin(store)
        assert connection.execute(count).scalar() == 1
        with pytest.raises(DBAPIError, match=r"read-?only"):
            connection.execute(text("DELETE FROM visits"))


@pytest.mark.parametrize(
    ("database", "words"),
    [
        ("sqlite://", "need a file"),
        ("sqlite:///:memory:", "need a file"),
        ("mysql://host/name", "'mysql' is not supported"),
        ("nonsense://", "not supported"),
        ("sqlite:///{dir}", "cannot be opened|directory"),
        ("sqlite:////proc/nowhere/galley.sqlite", "--database"),
        ("{text}", "not a database"),
        ("{foreign}", "not Galley's"),
    ],
)
def test_a_database_that_cannot_be_used_is_refused_in_one_line(
    tmp_path: Path, database: str, words: str
) -> None:
    (tmp_path / "text").write_text("this is no database, but a text of some length\n" * 40)
    with closing(sqlite3.connect(tmp_path / "foreign")) as foreign:
        foreign.execute("CREATE TABLE recipes (name TEXT)")
    names = {"dir": tmp_path, "text": tmp_path / "text", "foreign": tmp_path / "foreign"}
    with pytest.raises(GalleyError, match=words) as caught:
        Store.open(database.format(**names))
    assert "\n" not in str(caught.value)


def test_a_database_that_must_exist_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(GalleyError, match="no such database"):
        Store.open(tmp_path / "none.sqlite", must_exist=True)
    assert list(tmp_path.iterdir()) == []
