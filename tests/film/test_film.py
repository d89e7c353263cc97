"""Films show the round: how many pictures, how large, what is where, and one line for what cannot be."""

from __future__ import annotations

import math
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from galley.cli import app
from galley.errors import GalleyError
from galley.film import write as writing
from galley.film.footage import Footage, Reel, footage
from galley.film.painter import Painter
from galley.film.write import frames, write_film
from galley.kitchen import EAST, INTERACT, NORTH, SOUTH, STAY, WEST, Layout
from galley.kitchen.trajectory import HUMAN, NOBODY, Seat, Trajectory, write
from galley.workspace import frontend_folder

SPRITES = frontend_folder() / "sprites"
TILE = 40
KITCHEN = """
XXPXX
O1 2O
X   X
XDXSX
"""
# Seat 0 fetches three onions from its left and pots them; then a dish, the soup, and serves.
_ONE_ONION = [WEST, INTERACT, EAST, NORTH, INTERACT, WEST]
_SOUP = [*_ONE_ONION * 3, SOUTH, SOUTH, INTERACT, EAST, NORTH, NORTH, *[STAY] * 8]
_SERVE = [INTERACT, SOUTH, EAST, SOUTH, INTERACT, STAY, STAY]
GAME = [*_SOUP, *_SERVE]


def layout(**rules: object) -> Layout:
    return Layout.from_ascii("small", KITCHEN.strip("\n"), cook_time_ticks=10, **rules)


def trajectory(actions: list[int] = GAME, *, seats: tuple[Seat, Seat] | None = None) -> Trajectory:
    joint = np.array([(action, STAY) for action in actions], dtype=np.uint8).reshape(-1, 2)
    return Trajectory(layout(horizon_ticks=60), joint, seats or (HUMAN, Seat("agent", "stay")))


def filmed(**settings: object) -> Footage:
    return footage([trajectory()], "it", **settings)  # type: ignore[arg-type]


def share(picture: Image.Image, colour: str, box: tuple[float, float, float, float]) -> float:
    """How much of a box (tiles, below the wall) is of about this colour."""
    left, top, right, bottom = (round(length * TILE) for length in box)
    wall = round(0.4 * TILE)
    part = np.asarray(picture.crop((left, top + wall, right, bottom + wall)), dtype=int)
    wanted = [int(colour[at : at + 2], 16) for at in (1, 3, 5)]
    return float((np.abs(part - wanted).max(axis=-1) < 12).mean())


def test_pictures_come_at_an_even_pace_and_end_with_the_end() -> None:
    some = footage([trajectory(GAME[:7])], "it")
    at_speed = {speed: len(list(frames(some, SPRITES, 16, speed, 50.0))) for speed in (1.0, 2.0, 0.5, 20.0)}
    assert at_speed == {1.0: 22, 2.0: 12, 0.5: 43, 20.0: 3}
    assert {picture.size for picture in frames(some, SPRITES, 16, 20.0, 50.0)} == {(80, 16 * 4 + 6 + 8)}


def test_a_gif_lasts_as_long_as_the_round(tmp_path: Path) -> None:
    out = tmp_path / "round.gif"
    assert write_film(filmed(), SPRITES, out, 24, 2.0) == math.ceil(len(GAME) * 150 / 2 / 50) + 1
    lasted = 0
    with Image.open(out) as film:
        assert film.size == (120, 24 * 4 + 10 + 12)
        assert film.info["loop"] == 0
        for number in range(film.n_frames):  # type: ignore[attr-defined]
            film.seek(number)
            lasted += film.info["duration"]
    assert len(GAME) * 75 + 900 <= lasted <= len(GAME) * 75 + 1200
    assert [file.name for file in tmp_path.iterdir()] == ["round.gif"]


def test_an_mp4_lasts_as_long_as_the_round(tmp_path: Path) -> None:
    out = tmp_path / "round.mp4"
    made = write_film(filmed(), SPRITES, out, 17)
    with av.open(str(out)) as film:
        pictures = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        assert film.streams.video[0].codec_context.name == "h264"
    assert made == math.ceil(len(GAME) * 150 * 30 / 1000) + 1
    assert len(pictures) == made + 30
    assert pictures[0].shape == (82, 84, 3)  # both sides even
    painted = np.asarray(next(frames(filmed(), SPRITES, 17, 1, 50)), dtype=int)[:82, :84]
    assert np.abs(pictures[0] - painted).mean() < 8


def test_what_is_drawn_is_where_the_kitchen_has_it() -> None:
    painter, reel = Painter(filmed(), SPRITES, TILE), Reel(filmed())
    first = painter.paint(reel.at(0))
    assert share(first, "#0072B2", (1, 0.6, 2, 2)) > 0.05  # seat 0 has the blue hat and cloth
    assert share(first, "#E69F00", (3, 0.6, 4, 2)) > 0.05  # seat 1 the orange one
    assert share(first, "#0072B2", (2, 0.6, 5, 2)) == 0
    assert share(first, "#f0dfbd", (2, 2, 3, 3)) + share(first, "#e8d3ad", (2, 2, 3, 3)) > 0.3  # floor
    assert share(first, "#4cd07d", (2, 0, 3, 1)) == share(first, "#ffc23d", (2, 0, 3, 1)) == 0
    cooking = painter.paint(reel.at(22 * 150))
    assert share(cooking, "#ffc23d", (2, 0, 3, 1)) > 0.01  # the ring of progress
    ready = painter.paint(reel.at((len(_SOUP) - 1) * 150))
    assert share(ready, "#4cd07d", (2, 0, 3, 1)) > 0.03
    served = painter.paint(reel.at((len(GAME) - 2) * 150 + 75))
    assert share(served, "#ffd84d", (2.5, 1, 5, 3.5)) > 0.005  # +20 flies up
    assert share(ready, "#ffd84d", (2.5, 1, 5, 3.5)) < 0.001
    assert (reel.at(0).score, reel.at(reel.length_ms).score) == (0, 20)


def test_only_a_lone_participant_gets_a_ring() -> None:
    agents = (Seat("agent", "a"), Seat("agent", "b"))
    both = [
        Painter(some, SPRITES, TILE).paint(Reel(some).at(0))
        for some in (filmed(), footage([trajectory(seats=agents)], "it"))
    ]
    under = (0.9, 1.75, 1.4, 2.1)
    assert share(both[0], "#ffffff", under) > share(both[1], "#ffffff", under) + 0.05


def test_who_was_not_there_is_not_drawn() -> None:
    alone = footage([trajectory(seats=(HUMAN, NOBODY))], "it")
    picture = Painter(alone, SPRITES, TILE).paint(Reel(alone).at(0))
    assert share(picture, "#0072B2", (1, 0.6, 2, 2)) > 0.05
    assert share(picture, "#E69F00", (3, 0.6, 4, 2)) == 0
    assert alone.own == 0


def test_a_chef_glides_from_cell_to_cell() -> None:
    reel = Reel(footage([trajectory([EAST, WEST, WEST, STAY])], "it"))
    seen = [reel.at(ms).seen[0] for ms in (0, 75, 150, 225, 300)]
    assert seen == [(1, 1), (1.5, 1), (2, 1), (1.5, 1), (1, 1)]
    assert reel.at(75).lifts[0] > 0
    assert reel.at(340).seen[0][0] < 1  # against the onions
    assert reel.at(460).seen[0][0] < 1  # a bump is longer than a tick
    assert reel.at(500).seen[0] == (1, 1)


def test_episodes_follow_each_other_and_their_scores_add_up() -> None:
    both = footage([trajectory(), trajectory()], "it", hats=("orange", None))
    reel = Reel(both)
    half = len(GAME) * 150
    assert both.hats == ("orange", "blue")
    assert reel.length_ms == 2 * half
    assert reel.at(half + 1).kitchen.tick == 1
    assert [reel.at(ms).score for ms in (half - 1, half + 1, 2 * half)] == [20, 20, 40]
    assert reel.at(half + 1).share_left == pytest.approx(1, abs=0.01)


def told(*words: object) -> str:
    """What `galley trajectories draw` says in its one line."""
    answer = CliRunner().invoke(app, ["trajectories", "draw", *map(str, words)])
    if isinstance(answer.exception, GalleyError):
        return str(answer.exception)
    return answer.output.strip()


def test_mistakes_are_one_line(tmp_path: Path) -> None:
    source, out = tmp_path / "one.jsonl", tmp_path / "one.gif"
    write(trajectory(GAME[:4]), source)
    write(trajectory([]), tmp_path / "none.jsonl")
    (tmp_path / "bad.jsonl").write_text("{}\n", encoding="utf-8")
    said = {
        "ending": told(source, "--out", tmp_path / "one.avi"),
        "scale": told(source, "--out", out, "--scale", 9999),
        "speed": told(source, "--out", out, "--speed", 0),
        "nan": told(source, "--out", out, "--speed", "nan"),
        "both": told(source, "--round", 1, "--out", out),
        "neither": told("--out", out),
        "empty": told(tmp_path / "none.jsonl", "--out", out),
        "bad": told(tmp_path / "bad.jsonl", "--out", out),
        "gone": told(tmp_path / "gone.jsonl", "--out", out),
        "folder": told(source, "--out", tmp_path / "no" / "one.gif"),
        "records": told("--round", 1, "--out", out, "--database", tmp_path / "no.sqlite"),
    }
    wanted = {
        "ending": ".gif or .mp4",
        "scale": "from 16 to 128",
        "speed": "from 0.1 to 20",
        "nan": "from 0.1 to 20",
        "both": "draw one round",
        "neither": "draw one round",
        "empty": "no tick was played",
        "bad": "bad.jsonl:1:",
        "gone": "check the path",
        "folder": "name another file",
        "records": "no such database",
    }
    assert {name: words for name, words in wanted.items() if words not in said[name]} == {}, said
    assert all("\n" not in line for line in said.values())
    assert not list(tmp_path.glob("*.part")) + list(tmp_path.glob(".*.galley-part"))
    assert told(source, "--out", out, "--scale", 16) == f"{out}: 13 pictures of 4 ticks"


def test_without_the_extra_the_line_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writing, "NEEDED", ("resvg_py", "no_such_library"))
    assert "pip install 'galley[video]'" in told(tmp_path / "any.jsonl", "--out", tmp_path / "any.gif")
