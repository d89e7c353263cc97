"""Trajectories: written, read and replayed exactly; anything else is told with its line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import Kitchen, Layout
from galley.kitchen.codes import TICK
from galley.kitchen.trajectory import (
    Seat,
    Trajectory,
    episodes_of,
    from_text,
    play,
    read,
    replay,
    start,
    to_text,
    write,
)
from tests.kitchen.strategies import joint_actions, situations

ROOM = Layout.from_ascii("room", "XPTXX\nO1 2S\nXDXXX", horizon_ticks=10)
ACTIONS = np.array([[3, 4], [5, 0], [2, 5]], dtype=np.uint8)
EPISODE = Trajectory(ROOM, ACTIONS, (Seat("human"), Seat("agent", "myopic", "ab12")), seed=7)


@given(situations(), joint_actions())
def test_there_and_back_and_replayed(
    situation: tuple[Layout, NDArray[np.int16]], actions: NDArray[np.uint8]
) -> None:
    layout, state = situation
    seats = (Seat("agent", "stay", "0"), Seat("human"))
    again = from_text(to_text(Trajectory(layout, actions, seats, 2**70, state)), "t.jsonl")
    assert (again.layout, again.seats, again.seed) == (layout, seats, 2**70)
    np.testing.assert_array_equal(again.joint_actions, actions)
    states = replay(again)
    kitchen = Kitchen(layout)
    kitchen.state[:] = state
    for tick, (a0, a1) in enumerate(actions.tolist()):
        np.testing.assert_array_equal(states[tick], kitchen.state)
        kitchen.step(a0, a1)
    np.testing.assert_array_equal(states[-1], kitchen.state)


def test_files(tmp_path: Path) -> None:
    path = tmp_path / "one.jsonl"
    write(EPISODE, path)
    again = read(path)
    assert (again.layout, again.seats, again.seed, again.initial) == (ROOM, EPISODE.seats, 7, None)
    np.testing.assert_array_equal(replay(again), replay(EPISODE))
    np.testing.assert_array_equal(replay(again)[0], start(ROOM))
    header = json.loads(path.read_text().splitlines()[0])
    assert header["layout"]["rules"].pop("rule_set") == "classic"
    assert (
        from_text("\n".join([json.dumps(header), *to_text(EPISODE).splitlines()[1:]]), "old").layout == ROOM
    )
    assert (header["format"], header["ticks"], header["layout"]["grid"]) == (1, 3, list(ROOM.grid))


def test_events_of_a_replay() -> None:
    found = [(event.tick, event.seat, event.kind) for event in play(ROOM, ACTIONS).events()]
    assert found == [(0, 0, "blocked"), (1, 0, "pick_up"), (1, 1, "blocked")]


@pytest.mark.parametrize(
    ("ticks", "count", "lengths"),
    [
        (0, 2, [0]),
        (9, 2, [9]),
        (10, 2, [10]),
        (11, 2, [10, 1]),
        (25, 3, [10, 10, 5]),
        (25, 2, [10, 15]),
        (12, 1, [12]),
    ],
)
def test_a_round_is_cut_where_its_episodes_end(ticks: int, count: int, lengths: list[int]) -> None:
    actions = np.random.default_rng(1).integers(0, 6, (ticks, 2)).astype(np.uint8)
    found = episodes_of(Trajectory(ROOM, actions, EPISODE.seats, 7), count)
    assert [len(one.joint_actions) for one in found] == lengths
    np.testing.assert_array_equal(np.concatenate([one.joint_actions for one in found]), actions)
    assert {(one.seats, one.seed) for one in found} == {(EPISODE.seats, 7)}
    replays = [play(ROOM, one.joint_actions).to_its_end() for one in found]
    assert [one.ticks for one in replays] == [len(one.out) for one in replays]
    assert [one.ticks for one in replays] == [min(length, 10) for length in lengths]


def test_an_episode_that_began_elsewhere_ends_sooner() -> None:
    state = start(ROOM)
    state[TICK] = 7
    actions = np.full((6, 2), 4, dtype=np.uint8)
    found = episodes_of(Trajectory(ROOM, actions, initial=state), 2)
    assert [len(one.joint_actions) for one in found] == [3, 3]
    assert found[1].initial is None


def changed(line: int, text: str) -> str:
    lines = to_text(EPISODE).splitlines()
    lines[line - 1] = text
    return "\n".join(lines)


def header(**changes: object) -> str:
    return changed(1, json.dumps(json.loads(to_text(EPISODE).splitlines()[0]) | changes))


WHOLE = to_text(EPISODE)
STATE = start(ROOM).tolist()


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, "not a line of JSON"),
        ("[1]\n", 1, "not a line of JSON"),
        ("[" * 100_000, 1, "not a line of JSON"),
        (header(format=2), 1, "format is 2"),
        (header(ticks=4), 4, "the header says 4 ticks, the file has 3"),
        ("\n".join(WHOLE.splitlines()[:3]), 3, "the header says 3 ticks, the file has 2"),
        (WHOLE[:-4], 4, "not a line of JSON"),
        (WHOLE + WHOLE.splitlines()[3], 5, "the header says 3 ticks, the file has 4"),
        (changed(3, '{"tick":5,"actions":[0,0]}'), 3, "not tick 1"),
        (changed(3, '{"tick":1,"actions":[0,6]}'), 3, "not tick 1"),
        (changed(3, '{"tick":1,"actions":[0]}'), 3, "not tick 1"),
        (changed(3, '{"tick":1,"actions":[true,0]}'), 3, "not tick 1"),
        (changed(3, '{"tick":1}'), 3, "not tick 1"),
        (header(layout={}), 1, "not a layout"),
        (header(layout=ROOM.to_dict() | {"grid": ["XXX"]}), 1, "layout 'room'"),
        (header(seats=[]), 1, "the header is not whole"),
        (header(seats=[{"colour": "red"}] * 2), 1, "the header is not whole"),
        (header(ticks="3"), 1, "not a whole number"),
        (header(seed="x"), 1, "not a whole number"),
        (header(initial=STATE[:-1]), 1, "initial state does not fit"),
        (header(initial="x"), 1, "the header is not whole"),
        (header(initial=[99_999, *STATE[1:]]), 1, "the header is not whole"),
        (header(initial=[999, *STATE[1:]]), 1, "chef 0 has cell"),
        (header(initial=[0, *STATE[1:]]), 1, "chef 0 has cell"),
        (header(initial=[*STATE[:4], 7, *STATE[5:]]), 1, "chef 1 has cell"),
        (header(initial=[STATE[3], *STATE[1:]]), 1, "both chefs are in one cell"),
        (header(initial=[*STATE[:6], -1, *STATE[7:]]), 1, "tick, orders delivered, deliveries"),
        (header(initial=[*STATE[:-1], 9]), 1, "cell 14 holds 9"),
        (header(initial=[*STATE[:10], 1 + 4 * 2 + 16, *STATE[11:]]), 1, "cell 1 holds 25"),
    ],
)
def test_a_file_that_is_not_whole(text: str, line: int, message: str) -> None:
    with pytest.raises(GalleyError) as caught:
        from_text(text, "t.jsonl")
    told = str(caught.value)
    assert told.startswith(f"t.jsonl:{line}: ")
    assert message in told
    assert "; " in told
    assert "\n" not in told


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(GalleyError, match="cannot be read"):
        read(tmp_path / "none.jsonl")
    (tmp_path / "bytes.jsonl").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(GalleyError, match="not a text file"):
        read(tmp_path / "bytes.jsonl")


@pytest.mark.parametrize(
    "actions", [np.zeros((3, 2)), np.zeros((3, 3), dtype=np.uint8), np.full((1, 2), 6, dtype=np.uint8)]
)
def test_joint_actions_of_another_kind_are_refused(actions: NDArray[np.uint8]) -> None:
    with pytest.raises(GalleyError, match="actions must be"):
        Trajectory(ROOM, actions)
