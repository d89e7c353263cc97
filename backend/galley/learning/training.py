"""A training run: any method, step by step, from where it was."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from galley.learning.ppo.learner import Learner
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.rollout import Rollout
from galley.learning.ppo.update import UpdateFigures
from galley.learning.run_folder import RunFolder


@dataclass(frozen=True)
class Told:
    """What a step says of itself: a row of the log and the policies that joined the population."""

    row: dict[str, Any]
    joined: dict[str, Policy] = dataclasses.field(default_factory=dict)


class Training(Protocol):
    """A method of training, as a machine that makes one step at a time and can be taken up again.

    What a step does follows from the state alone, so that a run that was stopped ends as an unbroken one.
    """

    @property
    def finished(self) -> bool:
        """Whether nothing is left to do."""

    @property
    def share(self) -> float:
        """How much is done, 0 to 1."""

    def step(self) -> Told:
        """One update and what belongs to it."""

    def state(self) -> dict[str, Any]:
        """Everything to go on from here, but the policies that joined the population."""

    def restore(self, state: dict[str, Any], member: Callable[[str], Policy]) -> None:
        """Nothing; goes back to where `state` was taken; `member` gives the policies that had joined."""

    def best(self) -> Policy:
        """The policy that the run is for."""


def run(
    training: Training,
    folder: RunFolder,
    member: Callable[[str], Policy],
    *,
    save_every_s: float = 20.0,
    tell: Callable[[float, dict[str, Any]], None] = lambda share, row: None,
) -> Policy:
    """The policy that `training` ends with; goes on from the state in `folder` if there is one."""
    state = folder.load()
    seconds = 0.0
    if state is not None:
        seconds = float(state["seconds"])
        training.restore(state["training"], member)
    began = saved = time.monotonic()
    while not training.finished:
        told = training.step()
        now = time.monotonic()
        row = {**told.row, "seconds": round(seconds + now - began, 1)}
        for name, policy in told.joined.items():
            folder.keep(name, policy)
        folder.tell(row)
        tell(training.share, row)
        if told.joined or now - saved >= save_every_s or training.finished:
            folder.save({"training": training.state(), "seconds": seconds + now - began})
            saved = now
    return training.best()


def row_of(
    learner: Learner, rollout: Rollout, figures: UpdateFigures, *, ticks: int, generation: int, stage: str
) -> dict[str, Any]:
    """The row of the log that tells of one update."""
    return {
        "ticks": ticks,
        "generation": generation,
        "update": learner.done,
        "score": float(rollout.scores.mean()),
        "stage": stage,
        "shaping": float(rollout.shaping.sum(dim=(0, 1)).mean()),
        **dataclasses.asdict(figures),
    }
