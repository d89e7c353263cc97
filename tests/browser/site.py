"""A served study, and its records as an analyst gets them."""

from __future__ import annotations

import csv
import shutil
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from galley.server.rounds.key_state import MAX_WAITING
from tests.browser.participant import Participant
from tests.serving import run_galley, served

ROOT = Path(__file__).parents[2]
SECRET_NAMES = {"human-bc": "quokka", "myopic": "numbat", "stay": "wombat", "random": "bilby"}
"""Agent names that occur nowhere else, so that a page that holds one has told on an agent."""

NO_CHANGES: Mapping[str, str] = MappingProxyType({})
Rows = dict[str, list[dict[str, str]]]

KEY_OF = {"north": "up", "south": "down", "east": "right", "west": "left", "interact": "interact"}
KEY_NAMES = {
    "ArrowUp": "up",
    "ArrowDown": "down",
    "ArrowRight": "right",
    "ArrowLeft": "left",
    "Space": "interact",
}


@dataclass(frozen=True)
class Site:
    """A served study with its records."""

    url: str
    study: str
    database: str
    lab: Path

    @property
    def landing(self) -> str:
        """Where participants begin."""
        return f"{self.url}/s/{self.study}"

    def export(self, out: Path) -> Rows:
        """Return the rows of every exported file, after checking that every stored round replays."""
        options = ("--workspace", self.lab, "--database", self.database)
        verified = run_galley("trajectories", "verify", self.study, *options)
        assert verified.returncode == 0, verified.stdout + verified.stderr
        exported = run_galley("export", self.study, "--out", out, *options)
        assert exported.returncode == 0, exported.stderr
        return {file.stem: _rows(file) for file in out.glob("*.csv")}


@contextmanager
def open_site(folder: Path, study: Path, changes: Mapping[str, str] = NO_CHANGES) -> Iterator[Site]:
    """Serve one study from a workspace of its own, every agent under a secret name.

    `changes` are lines of the study file with what they are to become.
    """
    lab = _make_lab(folder / "lab", study)
    file = lab / "studies" / study.name
    for old, new in changes.items():
        text = file.read_text(encoding="utf-8")
        assert old in text
        file.write_text(text.replace(old, new), encoding="utf-8")
    database = f"sqlite:///{folder}/records.sqlite"
    with served(lab, database) as server:
        yield Site(server.url, study.stem, database, lab)


def newest_visit(rows: Rows) -> Rows:
    """Return the rows of every file that belong to the participant who came last."""
    return {
        name: _where(sheet, "participant", rows["participants"][-1]["participant"])
        for name, sheet in rows.items()
    }


def check_played(visit: Rows, participant: Participant, ticks: int) -> None:
    """Check that every round of a visit has all its ticks and no action that its keys do not call for."""
    assert {row["status"] for row in visit["rounds"]} == {"finished"}
    assert {row["agent"] for row in visit["rounds"]} <= set(SECRET_NAMES.values())
    for played, pressed in zip(visit["rounds"], participant.presses, strict=True):
        moments = _where(visit["ticks"], "round_id", played["round_id"])
        keys = _where(visit["keys"], "round_id", played["round_id"])
        assert [int(row["tick"]) for row in moments] == list(range(ticks))
        downs = Counter(row["key"] for row in keys if row["down"] == "true")
        assert downs <= Counter(KEY_NAMES[key] for key in pressed)
        acted = [(int(row["tick"]), KEY_OF.get(row["human_action"], "")) for row in moments]
        assert 0 < [key for _, key in acted].count("interact") <= downs["interact"], "once per press"
        called_for = _called_for(keys)
        assert [one for one in acted if one[1] and one not in called_for] == []
        assert len({key for _, key in acted}) > 2


def _called_for(keys: list[dict[str, str]]) -> set[tuple[int, str]]:
    """Return every (tick, key) that key events explain: while held, and a little later if taps queued."""
    called_for = set()
    since: dict[str, int] = {}
    for row in keys:
        if row["tick_applied"]:
            tick = int(row["tick_applied"])
            since.setdefault(row["key"], tick)
            if row["down"] == "false":
                called_for |= {
                    (at, row["key"]) for at in range(since.pop(row["key"]), tick + MAX_WAITING + 1)
                }
    return called_for


def _where(sheet: list[dict[str, str]], name: str, value: str) -> list[dict[str, str]]:
    return [row for row in sheet if row.get(name) == value]


def check_answered(visit: Rows, participant: Participant) -> None:
    """Check that what was answered, and no more, is on record in the order it was asked."""
    stored = [(row["item"], row["value"]) for row in visit["responses"] if row["value"]]
    assert stored == [(item, value) for _, item, value in participant.answers]


def _rows(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8", newline="") as opened:
        return list(csv.DictReader(opened))


def _make_lab(folder: Path, study: Path) -> Path:
    """Make a workspace with one study and every agent under its secret name."""
    for part in ("layouts", "questionnaires"):
        shutil.copytree(ROOT / part, folder / part)
    for name, secret in SECRET_NAMES.items():
        shutil.copytree(ROOT / "agents" / name, folder / "agents" / secret)
        _rename(folder / "agents" / secret / "agent.yaml")
    (folder / "studies").mkdir()
    _rename(Path(shutil.copy(study, folder / "studies")))
    return folder


def _rename(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    for name, secret in SECRET_NAMES.items():
        text = text.replace(f"name: {name}", f"name: {secret}").replace(f"agent: {name}", f"agent: {secret}")
        text = text.replace(f"[{name},", f"[{secret},").replace(f", {name}]", f", {secret}]")
    file.write_text(text, encoding="utf-8")
