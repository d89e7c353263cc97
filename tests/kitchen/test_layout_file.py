"""Layout files: the five that come with Galley, and every mistake told with its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from galley.errors import GalleyError, InvalidFiles
from galley.kitchen.layout_file import find_layout, load_layout, load_layouts
from galley.workspace import Workspace

ROOT = Path(__file__).resolve().parents[2]
HEAD = "format: 1\ntitle: A room\nsource: drawn for a test\n"
GOOD = ["XXPXX", "O1 2O", "XDXSX"]


def written(folder: Path, rows: list[str], rules: str = "", name: str = "room", head: str = HEAD) -> Path:
    (folder / "layouts").mkdir(exist_ok=True)
    path = folder / "layouts" / f"{name}.yaml"
    path.write_text(f"{head}{rules}grid: |\n" + "".join(f"  {row}\n" for row in rows), encoding="utf-8")
    return path


def problems(path: Path) -> list[str]:
    with pytest.raises(InvalidFiles) as caught:
        load_layout(path, "room.yaml")
    return [str(problem) for problem in caught.value.problems]


def test_the_layouts_of_the_paper_by_name_and_alias() -> None:
    layouts = load_layouts(Workspace(ROOT))
    aliases = {
        "cramped_room": ("simple", 5, 4),
        "asymmetric_advantages": ("unident_s", 9, 5),
        "coordination_ring": ("random1", 5, 5),
        "forced_coordination": ("random0", 5, 5),
        "counter_circuit": ("random3", 8, 5),
    }
    for name, (alias, width, height) in aliases.items():
        layout = layouts[name]
        assert layouts[alias] is layout
        assert layouts[name.replace("_", " ")] is layout
        assert (layout.width, layout.height) == (width, height)
        assert (layout.rules.cook_time_ticks, layout.rules.delivery_reward) == (20, 20)
        assert layout.rules.horizon_ticks == 400
        assert layout.source


def test_a_layout_file(tmp_path: Path) -> None:
    rules = "rules:\n  cook_time_ticks: 5\n  orders: [onion, onion]\naliases: [hall]\n"
    layout = load_layout(written(tmp_path, GOOD, rules))
    assert (layout.name, layout.title, layout.grid) == ("room", "A room", tuple(GOOD))
    assert (layout.rules.cook_time_ticks, layout.rules.orders) == (5, ("onion", "onion"))
    assert layout.rules.horizon_ticks == 400
    assert find_layout(Workspace(tmp_path), "hall") == layout


@pytest.mark.parametrize(
    ("rows", "line", "message"),
    [
        (["XXPXX", "O1 2O", "XDQSX"], 7, "tile 'Q' is unknown; use one of X P O T D S 1 2 or a space"),
        (["XXPXX", "O1 2", "XDXSX"], 6, "the row has 4 tiles, the others 5; make all rows equally long"),
        (["XXPXX", "O1  O", "XDXSX"], 4, "chef 2 is missing; put one 2 on the floor"),
        (["XXPXX", "O122O", "XDXSX"], 6, "chef 2 is there twice; keep one 2"),
        (["XXPXX", "O1 2O", "XD SX"], 7, "the border is open, a chef could walk out; close every edge"),
        (["XXPXX", "O1 2O", "XDXXS"], 7, "the serving place at column 5 cannot be reached by any chef"),
        (["XXPXX", "O1 2O", "XXPXX", "XDXSX"], 8, "the dish dispenser at column 2 cannot be reached"),
        (["XXXXX", "O1 2O", "XDXSX"], 4, "there is no pot; draw at least one P"),
        (["XXPXX", "X1 2X", "XDXSX"], 4, "there is no ingredient dispenser; draw at least one O or T"),
        (["XXPXX", "O1 2O", "XXXSX"], 4, "there is no dish dispenser; draw at least one D"),
        (["XXPXX", "O1 2O", "XDXXX"], 4, "there is no serving place; draw at least one S"),
    ],
)
def test_each_mistake_in_a_drawing(tmp_path: Path, rows: list[str], line: int, message: str) -> None:
    told = problems(written(tmp_path, rows))
    assert any(problem.startswith(f"room.yaml:{line}: ") and message in problem for problem in told), told


@pytest.mark.parametrize(
    ("rules", "line", "message"),
    [
        ("rules:\n  cook_time_ticks: 0\n", 5, "cook_time_ticks is 0; use a whole number from 1 to 2000"),
        ("rules:\n  horizon_ticks: 99999\n", 5, "horizon_ticks is 99999"),
        ("rules:\n  rule_set: modern\n", 5, "rule set 'modern' is unknown; use classic"),
        ("rules:\n  orders: [onion, soup]\n", 5, "order 'soup' is unknown; use onion or tomato"),
        ("rules:\n  orders: [tomato]\n", 6, "there is no tomato dispenser for the orders"),
        ("rules:\n  cook_time: 3\n", 5, "cook_time"),
        ("rules:\n  cook_time_ticks: many\n", 5, "cook_time_ticks"),
        ("aliases: ['']\n", 4, "an alias is empty"),
        ("colour: red\n", 4, "colour"),
    ],
)
def test_each_mistake_in_the_keys(tmp_path: Path, rules: str, line: int, message: str) -> None:
    told = problems(written(tmp_path, GOOD, rules))
    assert any(problem.startswith(f"room.yaml:{line}: ") and message in problem for problem in told), told


@pytest.mark.parametrize("key", ["format", "title", "source"])
def test_missing_keys_are_named(tmp_path: Path, key: str) -> None:
    head = "".join(line for line in HEAD.splitlines(keepends=True) if not line.startswith(key))
    assert any(key in problem for problem in problems(written(tmp_path, GOOD, head=head)))


def test_all_mistakes_of_all_files_at_once(tmp_path: Path) -> None:
    written(tmp_path, ["XXPXX", "O1 2O", "XDQS "], "rules:\n  cook_time_ticks: 0\n", name="a")
    written(tmp_path, ["XXPXX", "O1  O", "XDXSX"], name="b")
    written(tmp_path, GOOD, "aliases: [hall]\n", name="c")
    written(tmp_path, GOOD, "aliases: [hall, c]\n", name="d")
    with pytest.raises(InvalidFiles) as caught:
        load_layouts(Workspace(tmp_path))
    told = [f"{problem.path}:{problem.line}" for problem in caught.value.problems]
    assert told == [
        "layouts/a.yaml:5",
        "layouts/a.yaml:9",
        "layouts/a.yaml:9",
        "layouts/b.yaml:4",
        "layouts/d.yaml:4",
        "layouts/d.yaml:4",
    ]


def test_an_unknown_layout_is_told_with_the_nearest(tmp_path: Path) -> None:
    written(tmp_path, GOOD, "aliases: [hall]\n")
    with pytest.raises(GalleyError, match=r"no layout is named 'roam'.*'room'"):
        find_layout(Workspace(tmp_path), "roam")
    with pytest.raises(GalleyError, match="no layout is named"):
        find_layout(Workspace(tmp_path), "../room")
