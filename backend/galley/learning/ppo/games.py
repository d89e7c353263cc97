"""What policies score together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from galley.kitchen import Encoder, KitchenBatch, Layout
from galley.learning.ppo.forwards import Forwards, Machine, Ready
from galley.learning.ppo.policy import ENCODING, Policy
from galley.learning.ppo.rollout import Episodes, Pairing, choose


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


@torch.inference_mode()
def games_among(
    layout: Layout,
    policies: Sequence[Policy],
    games: int,
    seed: int,
    machine: Machine,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> NDArray[np.int64]:
    """int64 [policies, policies, games]: the scores of everybody on seat 0 with everybody on seat 1.

    All games are played side by side, each policy asked once a tick for all its seats; `tell` hears of ticks
    done and all.
    """
    size = len(policies)
    batch = KitchenBatch(layout, size * size * games)
    encoder, forwards = Encoder(layout, ENCODING), Forwards(machine)
    ready = [Ready(policy) for policy in policies]
    seats = np.stack([np.repeat(np.arange(size), size * games), np.tile(np.arange(size).repeat(games), size)])
    order = torch.from_numpy(np.argsort(seats, axis=None, kind="stable"))  # of both seats' rows, by policy
    seen = torch.empty((2, batch.size, *encoder.shape), dtype=torch.uint8)
    sides = [np.full(batch.size, seat, dtype=np.int64) for seat in (0, 1)]
    generator = torch.Generator().manual_seed(seed)
    joint = torch.empty(2 * batch.size, dtype=torch.int64)
    for tick in range(layout.rules.horizon_ticks):
        for seat, side in enumerate(sides):
            encoder.seat(batch.states, side, seen[seat].numpy())
        parts = seen.flatten(0, 1).index_select(0, order).chunk(size)
        logits = torch.cat([one.cpu() for one, _ in forwards(list(zip(ready, parts, strict=True)))])
        joint[order] = choose(logits, torch.rand(len(joint), generator=generator))
        batch.step(joint.view(2, -1).T.contiguous().numpy())
        tell(tick + 1, layout.rules.horizon_ticks)
    return batch.scores.astype(np.int64).reshape(size, size, games)


def probabilities(policy: Policy, seen: torch.Tensor, rows: int = 4800) -> torch.Tensor:
    """float32 [B, 6]: the policy's action probabilities for observations uint8 [B, 26, H, W]."""
    device = next(policy.parameters()).device
    with torch.inference_mode():
        return torch.cat([policy(part.to(device))[0].softmax(dim=1) for part in seen.split(rows)])
