"""What policies score together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from galley.kitchen import Layout
from galley.learning.forwards import Machine
from galley.learning.policy import Policy
from galley.learning.rollout import Episodes, Pairing


def games_with(
    layout: Layout, policy: Policy, partners: Sequence[Policy], games: int, seed: int, machine: Machine
) -> NDArray[np.int64]:
    """int64 [partners, 2, games]: the scores of `games` games of `policy` on seat 0 and on seat 1 with each.

    All games are played side by side, with sampled actions as in training. With itself the second half is
    the same matching again. Source: COLE paper, Sec. 5, simulator.
    """
    episodes = Episodes(layout, 2 * games * len(partners), machine)
    scores = episodes.scores(policy, [Pairing(partner, 2 * games) for partner in partners], seed)
    return scores.reshape(len(partners), games, 2).swapaxes(1, 2)


def probabilities(policy: Policy, seen: torch.Tensor, rows: int = 4800) -> torch.Tensor:
    """float32 [B, 6]: the policy's action probabilities for observations uint8 [B, 26, H, W]."""
    device = next(policy.parameters()).device
    with torch.inference_mode():
        return torch.cat([policy(part.to(device))[0].softmax(dim=1) for part in seen.split(rows)])
