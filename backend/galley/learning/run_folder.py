"""The folder of a training run: what was asked, where it is, what came out."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import torch
from torch.utils.tensorboard import SummaryWriter

from galley.errors import GalleyError
from galley.files.whole import whole_file, write_whole
from galley.kitchen import Layout
from galley.learning.ppo.policy import Policy
from galley.names import name_fix
from galley.runs.provenance import ORIGIN, origin

COLUMNS: Final = (
    "ticks",
    "generation",
    "update",
    "score",
    "stage",
    "shaping",
    "policy_loss",
    "value_loss",
    "entropy",
    "clipped",
    "divergence",
    "seconds",
)
"""Columns of `log.csv`: ticks learned from in the whole run, generation or member at work, its update, mean
score of the update's episodes, what the run is doing, extra reward an episode, figures of the update, seconds
at work."""


class RunFolder:
    """`runs/<name>`: run.json, log.csv, TensorBoard events, state.pt and the population in members/.

    A run that is stopped anywhere goes on from its last state: the state is written whole or not at all, and
    the log is cut back to where the state was.

    Raises:
        GalleyError: the folder holds a run that was asked for with other settings.
    """

    def __init__(self, path: Path, asked: Mapping[str, Any]) -> None:
        self.path = path
        self._state = path / "state.pt"
        self._log = path / "log.csv"
        self._told: list[dict[str, Any]] = []
        self._board: SummaryWriter | None = None
        described = path / "run.json"
        if described.is_file():
            self._compare(described, asked)
        else:
            (path / "members").mkdir(parents=True, exist_ok=True)
            told = {**asked, **origin(str(asked.get("device", "cpu")))}
            write_whole(described, json.dumps(told, indent=2, sort_keys=True) + "\n")

    def load(self) -> dict[str, Any] | None:
        """The last state that was saved, None at the beginning of a run.

        Raises:
            GalleyError: the state cannot be read.
        """
        if not self._state.is_file():
            return None
        found = load_tensors(self._state)
        self._told = list(found["log"])
        self._write_log()
        state: dict[str, Any] = found["run"]
        return state

    def save(self, state: Mapping[str, Any]) -> None:
        """Nothing; keeps `state` (tensors, numbers, lists and dicts of them) as the place to go on from."""
        save_tensors(self._state, {"run": dict(state), "log": self._told})

    def tell(self, row: Mapping[str, Any]) -> None:
        """Nothing; adds a row to the log."""
        kept = {column: row.get(column, "") for column in COLUMNS}
        new = not self._told
        self._told.append(kept)
        if new:
            self._write_log()
        else:
            with self._log.open("a", newline="") as file:
                csv.DictWriter(file, COLUMNS, lineterminator="\n").writerow(kept)
        if self._board is None:
            self._board = SummaryWriter(str(self.path / "board"), purge_step=int(kept["ticks"]))
        for name, value in kept.items():
            if isinstance(value, float):
                self._board.add_scalar(name, value, int(kept["ticks"]))

    def keep(self, name: str, policy: Policy) -> None:
        """Nothing; writes a policy of the population to members/."""
        save_tensors(self.path / "members" / f"{name}.pt", policy.state_dict())

    def member(self, name: str, layout: Layout, device: torch.device) -> Policy:
        """The policy kept under a name, to play with.

        Raises:
            GalleyError: there is none, or its weights are of another layout's shape.
        """
        return load_policy(self.path / "members" / f"{name}.pt", layout, device)

    def _write_log(self) -> None:
        lines = [",".join(COLUMNS)]
        lines += [",".join(str(row[column]) for column in COLUMNS) for row in self._told]
        write_whole(self._log, "\n".join(lines) + "\n")

    def _compare(self, described: Path, asked: Mapping[str, Any]) -> None:
        try:
            known = json.loads(described.read_text("utf-8"))
        except ValueError as error:
            raise GalleyError(f"{described}: is no JSON ({error}); remove the folder to start anew") from None
        wanted = json.loads(json.dumps(asked))
        names = {*known, *wanted} - {*ORIGIN}
        differing = sorted(key for key in names if known.get(key) != wanted.get(key))
        if differing:
            told = ", ".join(f"{key} {known.get(key)!r} (asked: {wanted.get(key)!r})" for key in differing)
            raise GalleyError(
                f"{self.path}: holds a run with other settings: {told}; ask for the same to go on with it, "
                "or name another folder with --out"
            )


def run_asked(path: Path, member: str = "best") -> dict[str, Any]:
    """What was asked of the run in a folder; of a finished run, where no other member is named.

    Raises:
        GalleyError: the folder holds no run, or one that has no such member.
    """
    described = path / "run.json"
    if not described.is_file():
        raise GalleyError(f"{path}: is no run (there is no run.json); name a folder that `learn train` made")
    if not (path / "members" / f"{member}.pt").is_file():
        if member == "best":
            raise GalleyError(f"{path}: the run is not finished; give the command again that began it")
        known = sorted(one.stem for one in (path / "members").glob("*.pt"))
        raise GalleyError(f"{path}: has no member {member!r}; {name_fix(member, known)}")
    found: dict[str, Any] = json.loads(described.read_text("utf-8"))
    return found


def load_policy(path: Path, layout: Layout, device: torch.device) -> Policy:
    """A policy of a run, to play with.

    Raises:
        GalleyError: the file is missing or damaged, or holds weights of another shape.
    """
    policy = Policy(layout).to(device)
    weights = load_tensors(path)
    own = policy.state_dict()
    if set(own) != set(weights) or any(own[key].shape != weights[key].shape for key in own):
        raise GalleyError(
            f"{path}: its weights do not fit layout {layout.name} with encoding grid; "
            "name a policy that was trained there"
        )
    policy.load_state_dict(weights)
    return policy.requires_grad_(False)


def load_tensors(path: Path) -> dict[str, Any]:
    """What `save_tensors` wrote; no code in the file is run.

    Raises:
        GalleyError: the file is missing or damaged.
    """
    try:
        found: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=True)
    except FileNotFoundError:
        raise GalleyError(f"{path}: there is no such file") from None
    except Exception as error:  # damaged files raise many things
        told = (str(error).splitlines() or [type(error).__name__])[0]
        raise GalleyError(f"{path}: cannot be read ({told}); remove the run's folder to start anew") from None
    return found


def save_tensors(path: Path, content: Mapping[str, Any]) -> None:
    """Nothing; writes a file that `torch.load` reads, whole or not at all."""
    with whole_file(path) as file:
        torch.save(dict(content), file)
