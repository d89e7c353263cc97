"""What every agent can do."""

from __future__ import annotations

from typing import Protocol

from numpy import int16
from numpy.typing import NDArray

from galley.kitchen import Layout


class Agent(Protocol):
    """Someone who acts for one seat of one kitchen.

    An agent is a function of its layout, seat, seed and what it has observed: `act` changes nothing, so
    asking twice gives one answer, and one that is reset and shown the same ticks again acts the same.
    """

    def reset(self, layout: Layout, seat: int, seed: int) -> None:
        """Begin an episode; everything observed before is forgotten.

        Raises:
            GalleyError: the agent does not know this layout.
        """

    def act(self, state: NDArray[int16], tick: int) -> int:
        """The action, 0 to 5, for this state (int16 [S]) at this tick."""

    def observe(self, state: NDArray[int16], joint_action: tuple[int, int]) -> None:
        """Take note of what both chefs did in `state`, the state before the joint action."""
