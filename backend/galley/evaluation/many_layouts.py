"""Many layouts evaluated at once, by processes of this machine or of a cluster."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

from galley.evaluation.teams import Team, evaluate
from galley.kitchen.layout import Layout
from galley.workers import map_tasks


def evaluate_many(
    layouts: Sequence[Layout],
    team: Team,
    workers: int = 1,
    scheduler: str | None = None,
    on_done: Callable[[int], None] | None = None,
) -> list[dict[str, Any]]:
    """The evaluation of each layout, in their order: the same whatever the number of workers.

    With one worker and no `scheduler` everything happens in this process; otherwise a Dask cluster of local
    processes, or the one at the scheduler's URL, does the work. `on_done` is told how many layouts are done.

    Raises:
        GalleyError: as `evaluate`; Dask is not installed; the scheduler does not answer.
    """
    done = 0

    def count(place: int, answer: dict[str, Any]) -> None:
        nonlocal done
        done += 1
        if on_done is not None:
            on_done(done)

    tasks = [layout.to_dict() for layout in layouts]
    return map_tasks(functools.partial(_from_dict, team=team), tasks, workers, scheduler, count)


def _from_dict(layout: dict[str, Any], team: Team) -> dict[str, Any]:
    return evaluate(Layout.from_dict(layout), team)
