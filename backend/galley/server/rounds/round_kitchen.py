"""The kitchen of a round through all of its episodes, one after the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from galley.kitchen import Kitchen, Layout
from galley.kitchen.trajectory import Trajectory, episodes_of


class RoundKitchen:
    """The kitchen of a round, begun anew for each episode.

    `ticks` counts through all episodes, `kitchen.tick` within one.
    An episode that is over stays until `next_episode`.
    """

    def __init__(self, layout: Layout, episodes: int = 1) -> None:
        self.layout = layout
        self.kitchen = Kitchen(layout)
        self.episode = 1
        self.episodes = episodes
        self.ticks = 0
        self.score_before = 0
        self._deliveries_before = 0
        self._state_before: NDArray[np.int16] | None = None

    @property
    def over(self) -> bool:
        """Whether every episode is over."""
        return self.kitchen.done and self.episode == self.episodes

    @property
    def between(self) -> bool:
        """Whether an episode is over and another follows."""
        return self.kitchen.done and self.episode < self.episodes

    @property
    def score(self) -> int:
        """Points of all episodes so far."""
        return self.score_before + self.kitchen.score

    @property
    def deliveries(self) -> int:
        """Soups that paid, in all episodes so far."""
        return self._deliveries_before + int(self.kitchen.view.deliveries)

    @property
    def last_state(self) -> NDArray[np.int16]:
        """The state after the last tick (int16 [S]); the start if there was none."""
        if self.kitchen.tick == 0 and self._state_before is not None:
            return self._state_before
        return self.kitchen.state

    def step(self, first: int, second: int) -> None:
        """One tick with the actions of seat 0 and seat 1."""
        self.kitchen.step(first, second)
        self.ticks += 1

    def take_up(self, joint_actions: NDArray[np.uint8]) -> None:
        """Play what was played of an episode (uint8 [T, 2]); if it is over, the next begins, if any."""
        for first, second in joint_actions.tolist():
            self.step(first, second)
        if self.between:
            self.next_episode()

    def next_episode(self) -> None:
        """Begin the next episode.

        Raises:
            ValueError: none follows.
        """
        if not self.between:
            raise ValueError("no episode follows now")
        self.score_before = self.score
        self._deliveries_before = self.deliveries
        self._state_before = self.kitchen.state.copy()
        self.episode += 1
        self.kitchen = Kitchen(self.layout)


def caught_up(layout: Layout, episodes: int, joint_actions: NDArray[np.uint8]) -> RoundKitchen:
    """The kitchen after the joint actions (uint8 [T, 2]) of all episodes so far."""
    round_kitchen = RoundKitchen(layout, episodes)
    for episode in episodes_of(Trajectory(layout, joint_actions), episodes):
        round_kitchen.take_up(episode.joint_actions)
    return round_kitchen
