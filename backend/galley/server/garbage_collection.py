"""When Python looks for garbage in cycles: as seldom as can be while rounds are played.

A search stops every thread, and a whole one takes tens of milliseconds with hundreds of visits. Nearly
everything here is freed without it, as soon as nothing refers to it; a search is for the rest.
"""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

NEW_OBJECTS = 50_000
"""So many more objects made than freed bring about a search among the new ones: more than what some hundred
rounds write down between two commits, which is gone by itself after them."""

LOOK_EVERY_S = 30.0
WHOLE_AT_LATEST_S = 900.0


@contextmanager
def few_collections() -> Iterator[None]:
    """Search seldom and only among what is new, until the block ends; what is here now is never searched."""
    before = gc.get_threshold()
    gc.collect()
    gc.freeze()
    gc.set_threshold(NEW_OBJECTS, 10, 1_000_000)
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()


async def collect_between_rounds(
    playing: Callable[[], bool],
    look_every_s: float = LOOK_EVERY_S,
    at_latest_s: float = WHOLE_AT_LATEST_S,
) -> None:
    """Search everything now and then while nobody plays, and once in `at_latest_s` also if somebody does.

    Runs until cancelled.
    """
    loop = asyncio.get_running_loop()
    last_s = loop.time()
    while True:
        await asyncio.sleep(look_every_s)
        if not playing() or loop.time() - last_s >= at_latest_s:
            gc.collect()
            last_s = loop.time()
