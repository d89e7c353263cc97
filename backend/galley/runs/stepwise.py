"""Long work step by step, which goes on where it was stopped."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

from galley.runs.run_folder import RunFolder

Member = TypeVar("Member")


@dataclass(frozen=True)
class Step(Generic[Member]):
    """What one step did: a row of the log, and what the run has made for good, by name."""

    row: dict[str, Any]
    joined: dict[str, Member] = field(default_factory=dict)


class Stepwise(Protocol[Member]):
    """Work that makes one step at a time and can be taken up again.

    What a step does follows from the state alone, so that a run that was stopped ends as an unbroken one.
    """

    @property
    def finished(self) -> bool:
        """Whether nothing is left to do."""

    @property
    def share(self) -> float:
        """How much is done, 0 to 1."""

    def step(self) -> Step[Member]:
        """The next step."""

    def state(self) -> dict[str, Any]:
        """Everything to go on from here, but the members that joined."""

    def restore(self, state: dict[str, Any], member: Callable[[str], Member]) -> None:
        """Go back to where `state` was taken; `member` gives the members that had joined."""


def run_to_end(
    work: Stepwise[Member],
    folder: RunFolder,
    *,
    pack: Callable[[Member], dict[str, Any]],
    unpack: Callable[[str], Member],
    save_every_s: float = 20.0,
    tell: Callable[[float, dict[str, Any]], None] = lambda share, row: None,
) -> None:
    """Do all steps of `work`, from the state in `folder` on if there is one.

    `pack` gives a member as `folder` keeps it, `unpack` the member that was kept under a name; `tell` hears
    after each step of the share done and its row of the log, which says the seconds at work.
    """
    state = folder.load()
    seconds = 0.0
    if state is not None:
        seconds = float(state["seconds"])
        work.restore(state["training"], unpack)
    began = saved = time.monotonic()
    while not work.finished:
        step = work.step()
        now = time.monotonic()
        row = {**step.row, "seconds": round(seconds + now - began, 1)}
        for name, member in step.joined.items():
            folder.keep(name, pack(member))
        folder.log(row)
        tell(work.share, row)
        if step.joined or now - saved >= save_every_s or work.finished:
            folder.save({"training": work.state(), "seconds": seconds + now - began})
            saved = now
