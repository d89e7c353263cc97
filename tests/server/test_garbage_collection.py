"""When Python looks for garbage: seldom, and not while somebody plays."""

from __future__ import annotations

import asyncio
import gc
import weakref
from collections.abc import Iterator
from contextlib import suppress

import pytest

from galley.server.garbage_collection import collect_between_rounds, few_collections


class Knot:
    """Refers to itself, so that only a search frees it."""

    def __init__(self) -> None:
        self.itself = self


@pytest.fixture
def found() -> Iterator[list[int]]:
    """The generations that were searched, one entry a search."""
    searched: list[int] = []

    def note(phase: str, info: dict[str, int]) -> None:
        if phase == "stop":
            searched.append(info["generation"])

    gc.callbacks.append(note)
    yield searched
    gc.callbacks.remove(note)


def test_what_is_there_at_the_start_is_never_searched_and_all_is_as_before_at_the_end() -> None:
    before = (gc.get_threshold(), gc.get_freeze_count())
    with few_collections():
        assert gc.get_freeze_count() > before[1]
        assert gc.isenabled()
    assert (gc.get_threshold(), gc.get_freeze_count()) == before


def test_objects_that_come_and_go_bring_about_no_search(found: list[int]) -> None:
    with few_collections():
        found.clear()
        for _ in range(20):
            rows = [[number] for number in range(10_000)]
            del rows
        assert found == []


def test_knots_are_found_among_the_new_before_they_are_many(found: list[int]) -> None:
    with few_collections():
        found.clear()
        knots = [weakref.ref(Knot()) for _ in range(200_000)]
        assert 2 not in found
        assert sum(knot() is not None for knot in knots) < 100_000


async def _run_for(seconds: float, playing: bool, at_latest_s: float) -> None:
    searching = asyncio.create_task(
        collect_between_rounds(lambda: playing, look_every_s=0.01, at_latest_s=at_latest_s)
    )
    await asyncio.sleep(seconds)
    searching.cancel()
    with suppress(asyncio.CancelledError):
        await searching


def test_everything_is_searched_while_nobody_plays(found: list[int]) -> None:
    with few_collections():
        knot = weakref.ref(Knot())
        gc.collect(1)
        asyncio.run(_run_for(0.5, playing=False, at_latest_s=1000.0))
        assert knot() is None
        assert 2 in found


def test_rounds_are_not_held_up_by_a_whole_search_before_it_is_due(found: list[int]) -> None:
    with few_collections():
        found.clear()
        asyncio.run(_run_for(0.3, playing=True, at_latest_s=1000.0))
        assert 2 not in found
        asyncio.run(_run_for(0.5, playing=True, at_latest_s=0.05))
        assert 2 in found
