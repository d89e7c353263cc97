"""The ground truth of the rules: games that people played, as the overcooked-ai package ships them."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest

from galley.datasets.overcooked_games import HumanGame, follows, human_games, import_files, matches
from galley.datasets.pickled_frames import read_frame
from galley.errors import GalleyError
from galley.kitchen.layout_file import load_layouts
from galley.workspace import Workspace
from tests.overcooked_package import human_games_folder

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def folder() -> Path:
    return human_games_folder()


@pytest.fixture(scope="module")
def games(folder: Path) -> list[HumanGame]:
    return human_games(folder / "clean_test_trials.pickle")


def test_every_transition_and_every_game_is_reproduced(folder: Path) -> None:
    report = import_files(sorted(folder.glob("clean_*_trials.pickle")))
    assert (report.transitions, report.matched, report.mismatched) == (91_102, 91_102, 0)
    assert (report.games, report.replayed, report.first_mismatch) == (76, 76, "")


def test_games_have_our_layouts(games: list[HumanGame]) -> None:
    ours = load_layouts(Workspace(ROOT))
    names = {game.layout.name for game in games}
    assert len(games) == 37
    assert names == {
        "cramped_room",
        "asymmetric_advantages",
        "coordination_ring",
        "forced_coordination",
        "counter_circuit",
    }
    for game in games:
        np.testing.assert_array_equal(game.layout.tiles, ours[game.layout.name].tiles)
        assert len(game.states) == len(game.joint_actions) == len(game.next_states) == len(game.rewards)
        assert game.layout.rules.horizon_ticks == len(game.states)
        assert game.states[:, 6].tolist() == list(range(len(game.states)))


def test_a_wrong_record_is_a_mismatch(games: list[HumanGame]) -> None:
    game = games[0]
    for name, change in (("next_states", 5), ("rewards", 20)):
        wrong = getattr(game, name).copy()
        wrong[100] += change
        changed = dataclasses.replace(game, **{name: wrong})
        assert np.flatnonzero(~matches(changed)).tolist() == [100]
        assert not follows(changed) or name == "next_states"
    actions = game.joint_actions.copy()
    actions[50] = (actions[50] + 1) % 6
    changed = dataclasses.replace(game, joint_actions=actions)
    assert not matches(changed)[50]
    assert not follows(changed)


def test_a_changed_file_is_reported_where_it_first_disagrees(folder: Path, tmp_path: Path) -> None:
    raw = (folder / "clean_test_trials.pickle").read_bytes()
    frame = read_frame(folder / "clean_test_trials.pickle")
    assert len(frame["state"]) == 44_373
    first = frame["state"][300].encode()
    turned = first.replace(b"'orientation': [0, -1]", b"'orientation': [0, 1] ")
    turned = turned.replace(b"'orientation': [-1, 0]", b"'orientation': [1, 0] ")
    assert turned != first
    path = tmp_path / "games.pickle"
    path.write_bytes(raw.replace(first, turned))
    report = import_files([path])
    assert report.mismatched >= 1
    assert report.replayed == 36
    assert report.first_mismatch == f"{path}: game 0, asymmetric_advantages, tick 299"


class Trap:
    """A pickle of this calls a function of our choice when it is loaded carelessly."""

    def __init__(self, call: object, *args: object) -> None:
        self.call, self.args = call, args

    def __reduce__(self) -> tuple:
        return self.call, self.args


@pytest.mark.parametrize(
    ("content", "named"),
    [
        (Trap(print, "caught"), "builtins.print"),
        (Trap(eval, "1"), "builtins.eval"),
        ([1, {"a": Trap(Path.cwd)}], "getattr"),
        (np.float64(1.0), "numpy"),
    ],
)
@pytest.mark.parametrize("protocol", [2, 4])
def test_a_pickle_that_names_anything_else_is_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: object, named: str, protocol: int
) -> None:
    path = tmp_path / "trap.pickle"
    path.write_bytes(pickle.dumps(content, protocol))
    with pytest.raises(GalleyError) as caught:
        import_files([path])
    told = str(caught.value)
    assert told.startswith(f"{path}: the pickle asks for ")
    assert "refused" in told
    assert "\n" not in told
    assert (
        named.replace("builtins", "__builtin__" if protocol == 2 else "builtins") in told or "scalar" in told
    )
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("content", [{"a": 1}, [], "text", None])
def test_a_pickle_that_is_no_frame_is_refused(tmp_path: Path, content: object) -> None:
    path = tmp_path / "other.pickle"
    path.write_bytes(pickle.dumps(content))
    with pytest.raises(GalleyError, match="not a pickled pandas frame"):
        import_files([path])


@pytest.mark.parametrize("content", [b"", b"not a pickle", b"\x80\x04\x95"])
def test_a_file_that_is_no_pickle_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.pickle"
    path.write_bytes(content)
    with pytest.raises(GalleyError, match="not a whole pickle"):
        import_files([path])
    with pytest.raises(GalleyError, match="cannot be read"):
        import_files([tmp_path / "missing.pickle"])


def test_a_truncated_file_is_refused(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "half.pickle"
    path.write_bytes((folder / "clean_test_trials.pickle").read_bytes()[:1_000_000])
    with pytest.raises(GalleyError, match="not a whole pickle"):
        import_files([path])


def frame_bytes(names: object, shape: object, dtype: object, content: object) -> bytes:
    """A pickle that asks for the very names that a frame of pandas 1 asks for, with parts of our choice."""
    made = (
        b"\x80\x04cpandas.core.frame\nDataFrame\n)\x81}\x8c\x05_datacpandas.core.internals.managers\n"
        b"BlockManager\n)\x81("
    )
    array = b"cnumpy.core.multiarray\n_reconstruct\n)R("
    state = (
        b"K\x01" + body(shape) + b"cnumpy\ndtype\n" + body((dtype,)) + b"R" + b"\x89" + body(content) + b"tb"
    )
    index = (
        array
        + b"K\x01"
        + body((1,))
        + b"cnumpy\ndtype\n"
        + body(("O8",))
        + b"R"
        + b"\x89"
        + body(names)
        + b"tb"
    )
    index = (
        b"cpandas.core.indexes.base\n_new_Index\n(cpandas.core.indexes.base\nIndex\n}\x8c\x04data"
        + index
        + b"stR"
    )
    return made + b"N](" + array + state + b"e](" + index + b"e" + b"tbsb."


def body(value: object) -> bytes:
    """The pickle of a plain value without what opens and ends it; nothing is kept for later use."""
    raw = pickle.dumps(value, 2)
    return raw[2:-1]


def doubling(depth: int) -> object:
    """A tuple of two of itself, so often that to write or hash it would take for ever."""
    value: object = "x"
    for _ in range(depth):
        value = (value, value)
    return value


def deep(depth: int) -> object:
    value: object = ()
    for _ in range(depth):
        value = (value,)
    return value


@pytest.mark.parametrize(
    ("names", "shape", "dtype", "content"),
    [
        pytest.param(["state"], (1, float("inf")), "O8", ["x"], id="infinite size"),
        pytest.param(["state"], (1, 10**30), "O8", ["x"], id="huge size"),
        pytest.param(["state"], (1, -1), "O8", ["x"], id="negative size"),
        pytest.param(["state"], (1,) * 500, "O8", ["x"], id="very many sizes"),
        pytest.param([doubling(60)], (1, 1), "O8", ["x"], id="name that doubles itself"),
        pytest.param(["state"], (1, 1), doubling(60), ["x"], id="type that doubles itself"),
        pytest.param(["state"], (1, 1), "O8", doubling(60), id="content that doubles itself"),
        pytest.param([deep(900)], (1, 1), "O8", ["x"], id="deep name"),
        pytest.param(7, (1, 1), "O8", ["x"], id="no names"),
    ],
)
def test_a12_a_frame_with_odd_parts_is_refused_in_one_line(
    tmp_path: Path, names: object, shape: object, dtype: object, content: object
) -> None:
    path = tmp_path / "odd.pickle"
    path.write_bytes(frame_bytes(names, shape, dtype, content))
    with pytest.raises(GalleyError) as caught:
        import_files([path])
    assert str(caught.value).startswith(f"{path}: not a pickled pandas frame (")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_a12_the_frame_of_the_tests_is_read_when_its_parts_are_plain(tmp_path: Path) -> None:
    path = tmp_path / "plain.pickle"
    path.write_bytes(frame_bytes(["state"], (1, 2), "O8", ["x", "y"]))
    assert read_frame(path)["state"].tolist() == ["x", "y"]
    path.write_bytes(frame_bytes(["state"], (1, 2), "O8", ["x", doubling(60)]))
    with pytest.raises(GalleyError, match="column layout_name is missing"):
        import_files([path])
