"""Nonsense on the play socket: the server stays up, refuses it, and the round goes on to its end."""

from __future__ import annotations

import itertools
import threading

import pytest
from sqlalchemy import func, select
from websockets.exceptions import ConnectionClosed

from galley.records.database.tables import ROUNDS, TICKS
from tests.security.conftest import Site
from tests.security.malformed import malformed
from tests.server.helpers import Player

HORIZON = 100
AT_A_TIME = 2000
"""More than a round has time for: some are sent until its end."""
SOME, MANY = 300, 10_000


@pytest.mark.parametrize("count", [SOME, pytest.param(MANY, marks=pytest.mark.full)])
def test_the_round_goes_on(site: Site, count: int) -> None:
    refused = 0
    for seed in itertools.count():
        refused += _one_round(site, seed)
        if refused >= count:
            break
    health = site.stranger().get("/healthz")
    assert health.status_code == 200
    assert health.json()["ok"]


def _one_round(site: Site, seed: int) -> int:
    """How many messages were refused in a round that was played to its end all the same."""
    one = site.at_the_round()
    with one.play() as player:
        player.hello()
        player.send("ready")
        player.until("tick")
        sending = threading.Thread(target=_send, args=(player, seed))
        sending.start()
        ended = player.until("ended")
        sending.join()
    assert ended["outcome"] == "finished"
    told = [frame["type"] for frame in player.received]
    assert told.count("refused") > 20, "refused one by one, as long as the round lasted"
    assert set(told) <= {"keyframe", "tick", "refused", "ended", "countdown", "pong"}
    assert one.load().status_code == 200
    kept = site.served.store.read(
        lambda connection: connection.execute(
            select(ROUNDS.c.status, func.count())
            .join(TICKS, TICKS.c.round_id == ROUNDS.c.id)
            .group_by(ROUNDS.c.id)
        ).all()
    )
    assert {tuple(row) for row in kept.result()} == {("finished", HORIZON)}
    return told.count("refused")


def _send(player: Player, seed: int) -> None:
    try:
        for message in malformed(seed, AT_A_TIME):
            player.socket.send(message)
    except ConnectionClosed:
        return


@pytest.mark.parametrize("first", [b"\x00", "x" * 1025, '{"type":"ready"}', '{"type":"hello","protocol":2}'])
def test_nonsense_before_hello_is_refused(site: Site, first: str | bytes) -> None:
    one = site.at_the_round()
    with one.play() as player:
        player.socket.send(first)
        assert player.next()["type"] == "refused"
        assert player.hello()["phase"] == "waiting"


def test_a_frame_of_a_megabyte_closes_that_connection_alone(site: Site) -> None:
    one, other = site.at_the_round(), site.at_the_round()
    with one.play() as player, other.play() as bystander:
        player.hello()
        bystander.hello()
        for size in itertools.repeat(1_000_000, 3):
            try:
                player.socket.send("x" * size)
            except ConnectionClosed:
                break
        assert player.closed_with() in (1009, 1006), "told why, unless what was sent is still in the way"
        bystander.send("ready")
        assert bystander.until("ended")["outcome"] == "finished"
    with one.play() as again:
        assert again.hello()["phase"] in ("waiting", "paused")
