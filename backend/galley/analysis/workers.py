"""Many layouts evaluated at once, by processes of this machine or of a cluster."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Any

from galley.analysis.evaluate import Team, evaluate
from galley.errors import GalleyError
from galley.kitchen.layout import Layout


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
    if scheduler is None and workers <= 1:
        found = []
        for number, layout in enumerate(layouts, start=1):
            found.append(evaluate(layout, team))
            if on_done is not None:
                on_done(number)
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
        futures = client.map(_from_dict, [layout.to_dict() for layout in layouts], team=team, pure=False)
        for number, _ in enumerate(as_completed(futures), start=1):
            if on_done is not None:
                on_done(number)
        answers: list[dict[str, Any]] = client.gather(futures)
        return answers
    finally:
        client.close()
        if cluster is not None:
            cluster.close()


def _from_dict(layout: dict[str, Any], team: Team) -> dict[str, Any]:
    return evaluate(Layout.from_dict(layout), team)
