"""A recorded episode as text, JSON Lines of `format: 1`, and its replay.

The first line is the header: layout in full with its rules, seed, who sat where, how many ticks follow,
and the state to start from if it is not the layout's own. Then one line a tick: `{"tick":0,"actions":[4,5]}`.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final, TypeGuard

import numpy as np
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.files.whole import write_whole
from galley.kitchen.codes import ACTIONS, OUT_SIZE, TICK
from galley.kitchen.events import Event, decode
from galley.kitchen.layout import Layout
from galley.kitchen.rules.shared import reset
from galley.kitchen.rules.tick import run
from galley.kitchen.state import score_of, state_problem, state_size

FORMAT: Final = 1


@dataclass(frozen=True)
class Seat:
    """Who controlled a chef: a human, or an agent by name and by the hash of its bundle; or nobody.

    Nobody is on the other seat of a game played alone: that chef stands still and was not seen.
    """

    kind: str
    name: str = ""
    sha256: str = ""


HUMAN: Final = Seat("human")
NOBODY: Final = Seat("nobody")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """One episode: `joint_actions` uint8[T,2], and `initial` int16[S] if it did not begin at the start.

    Raises:
        GalleyError: the actions or the initial state cannot belong to this layout.
    """

    layout: Layout
    joint_actions: NDArray[np.uint8]
    seats: tuple[Seat, Seat] = (HUMAN, HUMAN)
    seed: int | None = None
    initial: NDArray[np.int16] | None = None

    def __post_init__(self) -> None:
        actions = self.joint_actions
        if actions.dtype != np.uint8 or actions.ndim != 2 or actions.shape[1] != 2:
            raise GalleyError(
                f"joint actions must be uint8 [T, 2], not {actions.dtype} {list(actions.shape)}"
            )
        if (actions >= len(ACTIONS)).any():
            raise GalleyError(f"actions must be codes from 0 to {len(ACTIONS) - 1}")
        if self.initial is not None and (problem := state_problem(self.layout, self.initial)):
            raise GalleyError(f"the initial state does not fit layout {self.layout.name}: {problem}")


@dataclass(frozen=True, eq=False)
class Replay:
    """An episode run again: `states` int16[T+1,S] around its ticks, and what each wrote, `out` int32[T,4]."""

    layout: Layout
    states: NDArray[np.int16]
    out: NDArray[np.int32]

    @property
    def ticks(self) -> int:
        """How many ticks its clock ran: a kitchen whose episode is over does not change any more."""
        return int(self.states[-1, TICK] - self.states[0, TICK])

    @property
    def score(self) -> int:
        """The points that its kitchen shows at the end."""
        return int(score_of(self.layout, self.states[-1]))

    def to_its_end(self) -> Replay:
        """The same without the joint actions that came after the episode was over."""
        return Replay(self.layout, self.states[: self.ticks + 1], self.out[: self.ticks])

    def events(self) -> tuple[Event, ...]:
        """All events of the episode in order."""
        found: list[Event] = []
        for before, after, out in zip(self.states[:-1], self.states[1:], self.out, strict=True):
            found += decode(self.layout, before, after, out)
        return tuple(found)


def start(layout: Layout) -> NDArray[np.int16]:
    """int16[S]: the state in which an episode on this layout begins."""
    state = np.zeros(state_size(layout), dtype=np.int16)
    reset(layout.spec, state)
    return state


def play(
    layout: Layout, joint_actions: NDArray[np.uint8], initial: NDArray[np.int16] | None = None
) -> Replay:
    """The episode that `joint_actions` uint8[T,2] make from `initial` int16[S] or the layout's start."""
    ticks = len(joint_actions)
    states = np.empty((ticks + 1, state_size(layout)), dtype=np.int16)
    out = np.zeros((ticks, OUT_SIZE), dtype=np.int32)
    first = start(layout) if initial is None else np.array(initial, dtype=np.int16)
    run(layout.spec, first, np.ascontiguousarray(joint_actions, dtype=np.uint8), states, out)
    return Replay(layout, states, out)


def replay(trajectory: Trajectory) -> NDArray[np.int16]:
    """int16[T+1,S]: every state of the episode, the first before its first tick."""
    return play(trajectory.layout, trajectory.joint_actions, trajectory.initial).states


def episodes_of(whole: Trajectory, count: int) -> tuple[Trajectory, ...]:
    """The episodes of a round whose joint actions are one after the other in `whole`: from 1 to `count`.

    Each ends where its kitchen's clock stops, and the next begins at the layout's start; the last keeps
    all that is left, even what came after its end.
    """
    found: list[Trajectory] = []
    rest = whole
    while len(found) + 1 < count:
        begun = rest.joint_actions[: rest.layout.rules.horizon_ticks]
        ticks = play(rest.layout, begun, rest.initial).ticks
        if len(rest.joint_actions) <= ticks:
            break
        found.append(replace(rest, joint_actions=rest.joint_actions[:ticks]))
        rest = replace(rest, joint_actions=rest.joint_actions[ticks:], initial=None)
    return (*found, rest)


def to_text(trajectory: Trajectory) -> str:
    """The trajectory as JSON Lines."""
    header: dict[str, Any] = {
        "format": FORMAT,
        "layout": trajectory.layout.to_dict(),
        "seed": trajectory.seed,
        "seats": [asdict(seat) for seat in trajectory.seats],
        "ticks": len(trajectory.joint_actions),
    }
    if trajectory.initial is not None:
        header["initial"] = trajectory.initial.tolist()
    lines = [json.dumps(header, separators=(",", ":"))]
    for tick, (a0, a1) in enumerate(trajectory.joint_actions.tolist()):
        lines.append(f'{{"tick":{tick},"actions":[{a0},{a1}]}}')
    return "\n".join(lines) + "\n"


def from_text(text: str, shown: str) -> Trajectory:
    """The trajectory that `to_text` wrote; messages call its file `shown`.

    Raises:
        GalleyError: `file:line: what is wrong; how to fix it`, at the first line that is wrong.
    """
    lines = text.splitlines()
    header = _object(lines[0] if lines else "", f"{shown}:1")
    layout, seats, seed, ticks, initial = _header(header, f"{shown}:1")
    if len(lines) != ticks + 1:
        told = f"the header says {ticks} ticks, the file has {max(len(lines) - 1, 0)}"
        raise GalleyError(f"{shown}:{len(lines)}: {told}; get the whole file again")
    actions = np.empty((ticks, 2), dtype=np.uint8)
    for tick, line in enumerate(lines[1:]):
        place = f"{shown}:{tick + 2}"
        data = _object(line, place)
        pair = data.get("actions")
        if data.get("tick") != tick or not _is_joint_action(pair):
            fix = f'write {{"tick":{tick},"actions":[a,b]}} with codes from 0 to {len(ACTIONS) - 1}'
            raise GalleyError(f"{place}: not tick {tick} with its two actions; {fix}")
        actions[tick] = pair
    try:
        return Trajectory(layout, actions, seats, seed, initial)
    except GalleyError as error:
        raise GalleyError(f"{shown}:1: {error}; get the whole file again") from None


def write(trajectory: Trajectory, path: Path) -> None:
    """Write the trajectory so that `read(path)` gives it back."""
    write_whole(path, to_text(trajectory))


def read(path: Path) -> Trajectory:
    """The trajectory in a file.

    Raises:
        GalleyError: the file cannot be read or is not a whole trajectory; names file, line and fix.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise GalleyError(f"{path}: cannot be read ({reason}); check the path") from None
    except UnicodeDecodeError:
        raise GalleyError(f"{path}: not a text file; use a trajectory written by Galley") from None
    return from_text(text, str(path))


def _header(
    header: dict[str, Any], place: str
) -> tuple[Layout, tuple[Seat, Seat], int | None, int, NDArray[np.int16] | None]:
    if header.get("format") != FORMAT:
        told = f"format is {header.get('format')!r}"
        raise GalleyError(f"{place}: {told}; use a trajectory file of format {FORMAT}")
    try:
        layout = Layout.from_dict(header["layout"])
        seed, ticks = header["seed"], header["ticks"]
        first, second = (Seat(**seat) for seat in header["seats"])
        state = np.array(header["initial"], dtype=np.int16) if "initial" in header else None
    except GalleyError as error:
        raise GalleyError(f"{place}: {error}") from None
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise GalleyError(f"{place}: the header is not whole ({error!r}); get the whole file again") from None
    if not _is_count(ticks) or not (seed is None or isinstance(seed, int)):
        raise GalleyError(f"{place}: ticks or seed is not a whole number; get the whole file again")
    return layout, (first, second), seed, ticks, state


def _object(line: str, place: str) -> dict[str, Any]:
    try:
        data = json.loads(line)
    except (ValueError, RecursionError):
        data = None
    if not isinstance(data, dict):
        raise GalleyError(f"{place}: not a line of JSON with keys and values; get the whole file again")
    return data


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_joint_action(value: object) -> TypeGuard[list[int]]:
    return (
        isinstance(value, list) and len(value) == 2 and all(_is_count(a) and a < len(ACTIONS) for a in value)
    )
