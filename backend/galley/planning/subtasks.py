"""The subtasks of the kitchen by name, and when each is feasible."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Subtask:
    """One kind of subtask: what the chef holds who takes it up, and when it is feasible."""

    name: str
    holding: str
    feasible: str


SUBTASKS = (
    Subtask("wait", "anything", "nothing else is"),
    Subtask("take onion", "nothing", "some pot can take an onion, or the other chef needs one passed"),
    Subtask("take tomato", "nothing", "some pot can take a tomato, or the other chef needs one passed"),
    Subtask(
        "take dish", "nothing", "a soup cooks or is ready and no dish is on its way, or one must be passed"
    ),
    Subtask("take soup", "nothing", "a finished soup that the next order asks for lies on a counter"),
    Subtask("fill pot", "onion or tomato", "some pot can take it"),
    Subtask("fetch soup", "dish", "a soup cooks or is ready in a pot; who is early waits beside it"),
    Subtask("deliver", "soup", "always, unless it is ordered only later"),
    Subtask("drop", "anything", "the thing is of no use in hand: on a shared counter if the other needs it"),
)
"""In the order of the kernels' codes. Source: Fontaine et al. 2021 (RSS), Fig. 9; passing, orders: ours."""
