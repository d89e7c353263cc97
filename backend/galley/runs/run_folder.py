"""The folder of a run: what was asked, where it is, what came out."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from galley.errors import GalleyError
from galley.files.lock import FileLock
from galley.files.whole import clear_left, write_whole
from galley.runs.state_file import StateFormat


class RunFolder:
    """A folder with `run.json`, `log.csv`, `state.*` and what the run keeps in `members/`.

    A run that is stopped anywhere goes on from its last state: the state is written whole or not at all, and
    the log is cut back to where the state was. `settings` (as JSON) make the run what it is; `provenance`
    stands beside them in `run.json`, but may differ when a run goes on. `columns` are those of `log.csv`,
    `former` names the columns that had other names in runs of earlier versions.

    Raises:
        GalleyError: the folder holds a run with other settings.
    """

    def __init__(
        self,
        path: Path,
        settings: Mapping[str, Any],
        *,
        columns: Sequence[str],
        states: StateFormat,
        provenance: Mapping[str, str],
        former: Mapping[str, str] | None = None,
    ) -> None:
        self.path = path
        self._columns = tuple(columns)
        self._states = states
        self._former = dict(former or {})
        self._state = path / f"state{states.ending}"
        self._log = path / "log.csv"
        self._rows: list[dict[str, Any]] = []
        described = path / "run.json"
        if described.is_file():
            self._compare(described, settings, provenance)
        else:
            (path / "members").mkdir(parents=True, exist_ok=True)
            told = {**settings, **provenance}
            write_whole(described, json.dumps(told, indent=2, sort_keys=True) + "\n")

    def lock(self, doing: str) -> FileLock:
        """The lock without which nobody works in the folder; `doing` says what one does there. What
        was left half-written by a run that was killed is taken away.

        Raises:
            GalleyError: another process holds it.
        """
        lock = FileLock(
            self.path / "lock",
            f"{self.path}: another process {doing} here ({{holder}}); wait for it, or name another folder "
            "with --out",
        )
        for folder in (self.path, self.path / "members"):
            clear_left(folder)
        return lock

    def load(self) -> dict[str, Any] | None:
        """The last state that was saved, None at the beginning of a run; the log is cut back to it.

        Raises:
            GalleyError: the state cannot be read.
        """
        if not self._state.is_file():
            return None
        found = self._states.read(self._state)
        self._rows = [
            self._row({self._former.get(key, key): row[key] for key in row}) for row in found["log"]
        ]
        self._write_log()
        state: dict[str, Any] = found["run"]
        return state

    def save(self, state: Mapping[str, Any]) -> None:
        """Keep `state`, which the format of states can hold, as the place to go on from."""
        self._states.write(self._state, {"run": dict(state), "log": self._rows})

    def log(self, row: Mapping[str, Any]) -> None:
        """Add a row to the log; other keys than its columns are left out."""
        kept = self._row(row)
        self._rows.append(kept)
        if len(self._rows) == 1:
            self._write_log()
            return
        with self._log.open("a", newline="") as file:
            csv.DictWriter(file, self._columns, lineterminator="\n").writerow(kept)

    def keep(self, name: str, member: Mapping[str, Any]) -> None:
        """Write a member of what the run makes, in the format of states, to `members/`."""
        self._states.write(self.member_path(name), member)

    def member(self, name: str) -> dict[str, Any]:
        """The member that was kept under a name.

        Raises:
            GalleyError: there is none, or its file is damaged.
        """
        return self._states.read(self.member_path(name))

    def member_path(self, name: str) -> Path:
        """Where the member of a name is kept."""
        return self.path / "members" / f"{name}{self._states.ending}"

    def _row(self, row: Mapping[str, Any]) -> dict[str, Any]:
        return {column: row.get(column, "") for column in self._columns}

    def _write_log(self) -> None:
        lines = [",".join(self._columns)]
        lines += [",".join(str(row[column]) for column in self._columns) for row in self._rows]
        write_whole(self._log, "\n".join(lines) + "\n")

    def _compare(self, described: Path, settings: Mapping[str, Any], provenance: Mapping[str, str]) -> None:
        try:
            known = json.loads(described.read_text("utf-8"))
        except ValueError as error:
            raise GalleyError(f"{described}: is no JSON ({error}); remove the folder to start anew") from None
        wanted = json.loads(json.dumps(settings))
        names = {*known, *wanted} - {*provenance}
        differing = sorted(key for key in names if known.get(key) != wanted.get(key))
        if differing:
            told = ", ".join(f"{key} {known.get(key)!r} (asked: {wanted.get(key)!r})" for key in differing)
            raise GalleyError(
                f"{self.path}: holds a run with other settings: {told}; ask for the same to go on with it, "
                "or name another folder with --out"
            )
