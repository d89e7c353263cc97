"""Small kitchens for learning: a few ticks, a few cells."""

from __future__ import annotations

import torch

from galley.kitchen import Layout
from galley.learning.forwards import Machine
from galley.learning.settings import PPOSettings

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
