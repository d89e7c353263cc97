"""The same work done for many things, by this process, by others, or by a cluster."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import TypeVar

from galley.errors import GalleyError

Task = TypeVar("Task")
Answer = TypeVar("Answer")


def map_tasks(
    do: Callable[[Task], Answer],
    tasks: Sequence[Task],
    workers: int = 1,
    scheduler: str | None = None,
    on_done: Callable[[int, Answer], None] | None = None,
) -> list[Answer]:
    """The answer to each task, in their order.

    With one worker and no `scheduler` everything happens in this process; otherwise a Dask cluster of local
    processes, or the one at the scheduler's URL, does the work, and `do`, tasks and answers travel to it and
    back. `on_done` is told the place of each task and its answer as soon as it is there, in any order.

    Raises:
        GalleyError: as `do`; Dask is not installed; the scheduler does not answer.
    """
    if scheduler is None and workers <= 1:
        found = []
        for place, task in enumerate(tasks):
            found.append(do(task))
            if on_done is not None:
                on_done(place, found[-1])
        return found
    try:
        from distributed import Client, LocalCluster, as_completed
    except ImportError:
        raise GalleyError(
            "several workers need Dask; install it with: pip install 'galley[evaluate]'"
        ) from None
    cluster = None
    if scheduler is None:
        cluster = LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=logging.ERROR
        )
    try:
        client = Client(cluster if cluster is not None else scheduler, timeout="10s")
    except (OSError, ValueError) as error:
        raise GalleyError(
            f"the scheduler {scheduler} does not answer ({error}); start it with: dask scheduler"
        ) from None
    try:
        futures = client.map(do, tasks, pure=False)
        places = {future.key: place for place, future in enumerate(futures)}
        answers: dict[int, Answer] = {}
        for future, answer in as_completed(futures, with_results=True):
            place = places[future.key]
            answers[place] = answer
            if on_done is not None:
                on_done(place, answer)
        return [answers[place] for place in range(len(futures))]
    finally:
        client.close()
        if cluster is not None:
            cluster.close()
