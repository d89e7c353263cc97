"""Proximal policy optimisation, one update from top to bottom."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch.nn import functional

from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.replicas import Replicas
from galley.learning.ppo.rollout import Rollout


@dataclass(frozen=True)
class UpdateFigures:
    """What an update tells of itself: means over its minibatches."""

    policy_loss: float
    value_loss: float
    entropy: float
    clipped: float
    """Share of rows whose ratio left the clip range."""
    divergence: float
    """Estimate of KL(at play, now), in nats."""


def advantages(
    rollout: Rollout, settings: PPOSettings, shaping: float, bonus: torch.Tensor | None = None
) -> tuple[torch.Tensor, torch.Tensor]:
    """Generalised advantages and returns, float32 [T, N] each, of whole episodes.

    `shaping` is the present weight of the extra reward; `bonus` [T, N] is added as it is.

    Source: Schulman et al. 2016 (arXiv:1506.02438), eq. 16; an episode is worth nothing after its horizon.
    """
    own, others = rollout.shaping
    extra = own + settings.partner_shaping * others
    rewards = settings.reward_scale * (rollout.rewards + shaping * extra)
    if bonus is not None:
        rewards = rewards + bonus
    rewards, values = rewards.cpu(), rollout.values.cpu()  # many small steps, which a GPU is slow at
    found = torch.empty_like(rewards)
    following = torch.zeros_like(rewards[0])
    carried = torch.zeros_like(rewards[0])
    for tick in range(len(rewards) - 1, -1, -1):
        surprise = rewards[tick] + settings.gamma * following - values[tick]
        carried = surprise + settings.gamma * settings.lambda_ * carried
        found[tick] = carried
        following = values[tick]
    found = found.to(rollout.values.device)
    return found, found + rollout.values


def update(
    policy: Policy,
    optimiser: torch.optim.Optimizer,
    rollout: Rollout,
    settings: PPOSettings,
    *,
    progress: float,
    shaping: float,
    seed: int,
    bonus: torch.Tensor | None = None,
    machine: Machine,
) -> UpdateFigures:
    """What one update did to `policy`; `progress` in 0..1 is how much of the run is over.

    Source: Schulman et al. 2017 (arXiv:1707.06347), eq. 7 and 9; advantages are normalised in each minibatch
    as in the code of Carroll et al. 2019.
    """
    device = rollout.actions.device
    found, returns = advantages(rollout, settings, shaping, bonus)
    seen = rollout.seen.flatten(0, 1)
    actions = rollout.actions.flatten()
    before = rollout.log_probabilities.flatten()
    found, returns = found.flatten(), returns.flatten()

    entropy_weight = settings.entropy_start + progress * (settings.entropy_end - settings.entropy_start)
    for group in optimiser.param_groups:
        group["lr"] = settings.learning_rate * (1 - progress * (1 - settings.final_rate_share))

    def passed(replica: Policy, rows: torch.Tensor, gained: torch.Tensor, size: int) -> torch.Tensor:
        """float32 [5]: the figures of some rows of a minibatch of `size`; their gradients go to `replica`."""
        with torch.autocast(device.type, torch.bfloat16, enabled=machine.bf16):
            logits, values = replica(seen.index_select(0, rows))  # several times as quick as seen[rows]
        log_policy = functional.log_softmax(logits, dim=1)
        now = log_policy.gather(1, actions[rows].unsqueeze(1)).squeeze(1)
        entropy = -(log_policy.exp() * log_policy).sum(dim=1)
        change = now - before[rows]
        ratio = change.exp()
        clipped = ratio.clamp(1 - settings.clip, 1 + settings.clip)
        policy_loss = -torch.minimum(ratio * gained, clipped * gained)
        value_loss = 0.5 * (values - returns[rows]).square()
        loss = policy_loss + settings.value_coefficient * value_loss - entropy_weight * entropy
        (loss.sum() / size).backward()
        told = (policy_loss, value_loss, entropy, (ratio != clipped).float(), ratio - 1 - change)
        return torch.stack([one.detach().sum() for one in told]) / size

    generator = torch.Generator().manual_seed(seed)
    figures = torch.zeros(5, device=device)
    with Replicas(policy, machine) as replicas:
        for _ in range(settings.epochs):
            order = torch.randperm(len(actions), generator=generator).to(device)
            for rows in order.chunk(settings.minibatches):
                gained = found[rows]
                gained = (gained - gained.mean()) / (gained.std() + 1e-8)
                optimiser.zero_grad(set_to_none=True)
                figures += replicas.add_gradients(passed, rows, gained)
                torch.nn.utils.clip_grad_norm_(policy.parameters(), settings.max_gradient_norm)
                optimiser.step()
    means = (figures / (settings.epochs * settings.minibatches)).tolist()
    return UpdateFigures(*means)


def adam(policy: Policy, settings: PPOSettings) -> torch.optim.Adam:
    """The optimiser of a policy."""
    return torch.optim.Adam(policy.parameters(), lr=settings.learning_rate, eps=1e-5, fused=True)


def shaping_weight(ticks: int, settings: PPOSettings) -> float:
    """The weight of the extra reward after `ticks` ticks of learning: 1 falling linearly to 0."""
    return max(0.0, 1 - ticks / settings.shaping_ticks) if settings.shaping_ticks > 0 else 0.0
