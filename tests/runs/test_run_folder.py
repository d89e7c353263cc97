"""A run of whatever work goes on where it was stopped, in a folder that only one process works in."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.runs.provenance import provenance
from galley.runs.run_folder import RunFolder
from galley.runs.state_file import NumpyStates
from galley.runs.stepwise import Step, run_to_end

Point = NDArray[np.float64]


class Walk:
    """A walk on a line whose every third place is kept for good."""

    def __init__(self) -> None:
        self.place = np.zeros(1)
        self.done = 0

    @property
    def finished(self) -> bool:
        return self.done >= 7

    @property
    def share(self) -> float:
        return self.done / 7

    def step(self) -> Step[Point]:
        self.place = self.place + np.random.default_rng(self.done).normal(size=1)
        self.done += 1
        kept = {f"{self.done:04}": self.place} if self.done % 3 == 0 else {}
        return Step({"step": self.done, "place": float(self.place[0])}, kept)

    def state(self) -> dict[str, Any]:
        return {"place": self.place, "done": self.done, "names": ["a", "b"]}

    def restore(self, state: dict[str, Any], member: Callable[[str], Point]) -> None:
        assert state["names"] == ["a", "b"]
        self.place, self.done = state["place"], state["done"]
        if self.done >= 3:
            assert member("0003").shape == (1,)


def folder_at(path: Path, **how: Any) -> RunFolder:
    settings = {"seed": 1, "size": (4, 5), **how.pop("settings", {})}
    columns = ("step", "place", "seconds")
    return RunFolder(path, settings, columns=columns, states=NumpyStates(), provenance=provenance(), **how)


def walk(path: Path, stop_after: int | None = None) -> Walk:
    work, folder = Walk(), folder_at(path)

    def tell(share: float, row: dict[str, Any]) -> None:
        if stop_after is not None and row["step"] > stop_after:
            raise KeyboardInterrupt

    run_to_end(
        work, folder, pack=lambda place: {"place": place}, unpack=lambda name: folder.member(name)["place"],
        save_every_s=0.0, tell=tell,
    )  # fmt: skip
    return work


def rows(path: Path) -> list[list[str]]:
    return [line.split(",")[:2] for line in (path / "log.csv").read_text().splitlines()]


def test_a_stopped_run_ends_as_an_unbroken_one(tmp_path: Path) -> None:
    whole = walk(tmp_path / "whole")
    for stop in (0, 2, 3, 5):
        with pytest.raises(KeyboardInterrupt):
            walk(tmp_path / "broken", stop)
        assert len(rows(tmp_path / "broken")) == 1 + stop + 1  # the row of the step that was lost
    assert walk(tmp_path / "broken").place == whole.place
    assert rows(tmp_path / "broken") == rows(tmp_path / "whole")
    assert rows(tmp_path / "whole")[0] == ["step", "place"]
    assert [path.name for path in sorted((tmp_path / "broken" / "members").iterdir())] == [
        "0003.npz",
        "0006.npz",
    ]


def test_a_run_goes_on_with_the_same_settings_whatever_it_is_made_with(tmp_path: Path) -> None:
    folder_at(tmp_path / "run")
    described = tmp_path / "run" / "run.json"
    kept = json.loads(described.read_text())
    assert kept["galley"]
    assert kept["size"] == [4, 5]
    described.write_text(json.dumps(kept | {"processor": "Another Machine", "commit": "none"}))
    folder_at(tmp_path / "run")
    with pytest.raises(GalleyError, match=r"other settings: seed 1 \(asked: 2\); ask for the same"):
        folder_at(tmp_path / "run", settings={"seed": 2})
    described.write_text("{")
    with pytest.raises(GalleyError, match="is no JSON"):
        folder_at(tmp_path / "run")


def test_columns_that_had_other_names_go_on_under_those_of_today(tmp_path: Path) -> None:
    NumpyStates().write(tmp_path / "state.npz", {"run": {}, "log": [{"step": 1, "spot": 0.5, "gone": 2}]})
    folder = folder_at(tmp_path, former={"spot": "place"})
    assert folder.load() == {}
    folder.log({"step": 2, "place": 0.25, "more": "left out"})
    assert (tmp_path / "log.csv").read_text() == "step,place,seconds\n1,0.5,\n2,0.25,\n"


def test_one_works_in_a_folder(tmp_path: Path) -> None:
    folder = folder_at(tmp_path)
    with folder.lock("searches"), pytest.raises(GalleyError, match="another process searches here"):
        folder_at(tmp_path).lock("searches")


def test_states_of_numpy_come_back_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "state.npz"
    states = [{"grid": np.arange(6, dtype=np.int16).reshape(2, 3), "best": np.float64(0.5)}, None, "text"]
    NumpyStates().write(path, {"states": states, "empty": np.zeros((0, 2))})
    found = NumpyStates().read(path)
    np.testing.assert_array_equal(found["states"][0]["grid"], states[0]["grid"], strict=True)
    assert found["states"][0]["best"] == 0.5
    assert found["states"][1:] == [None, "text"]
    assert found["empty"].shape == (0, 2)
    for damage in (b"", b"half a fi", path.read_bytes()[:-40]):
        path.write_bytes(damage)
        with pytest.raises(GalleyError, match="cannot be read"):
            NumpyStates().read(path)
    with pytest.raises(GalleyError, match="there is no such file"):
        NumpyStates().read(tmp_path / "none.npz")
