"""Small kitchens for learning, a few ticks and a few cells, and policies for them."""

from __future__ import annotations

import torch

from galley.kitchen import Layout
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.policy import Policy

CPU = Machine(torch.device("cpu"))

SMALL = Layout.from_ascii(
    "small",
    """
    XXPXX
    O1  O
    X  2X
    XDXSX
    """,
    cook_time_ticks=3,
    horizon_ticks=12,
)

QUICK = PPOSettings(
    ticks=8 * 12, minibatches=2, epochs=2, clip=0.2, learning_rate=1e-3, max_gradient_norm=0.5,
    shaping_ticks=500,
)  # fmt: skip
"""Eight kitchens of twelve ticks an update."""


def policy(seed: int) -> Policy:
    """Untrained weights of a seed, to play with."""
    return Policy(SMALL, torch.Generator().manual_seed(seed)).requires_grad_(False)


class Always(Policy):
    """A policy that takes one action."""

    def __init__(self, action: int) -> None:
        super().__init__(SMALL)
        self.action = action

    def forward(self, seen: torch.Tensor, prepared: object = None) -> tuple[torch.Tensor, torch.Tensor]:
        logits = torch.full((len(seen), 6), -50.0)
        logits[:, self.action] = 50.0
        return logits, torch.zeros(len(seen))
