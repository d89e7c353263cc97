"""Proximal policy optimisation, one update from top to bottom."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch.nn import functional

from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.policy import Policy
from galley.learning.ppo.replicas import Replicas
from galley.learning.ppo.rollout import Rollout


@dataclass(frozen=True)
class UpdateMetrics:
    """The metrics of PPO, means over an update's minibatches; names and formulas are the field's.

    Source: CleanRL, `ppo.py` (Huang et al. 2022, "The 37 Implementation Details of PPO", details 8 to 12).
    """

    policy_loss: float
    """The clipped surrogate objective, negative. Source: Schulman et al. 2017 (arXiv:1707.06347), eq. 7."""
    value_loss: float
    """Half the squared error of the values against the returns. Source: the same, eq. 9."""
    entropy: float
    """Of the policy, in nats."""
    clip_fraction: float
    """Share of rows whose probability ratio left the clip range."""
    approx_kl: float
    """KL(policy at play, policy now) in nats, estimated as the mean of ratio - 1 - log ratio.

    Source: Schulman 2020, "Approximating KL divergence", joschu.net/blog/kl-approx.html, estimator k3.
    """
    explained_variance: float
    """1 - Var(returns - values) / Var(returns), of the values at play; NaN where all returns are equal."""


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
    estimates = torch.empty_like(rewards)
    next_value = torch.zeros_like(rewards[0])
    advantage = torch.zeros_like(rewards[0])
    for tick in range(len(rewards) - 1, -1, -1):
        delta = rewards[tick] + settings.gamma * next_value - values[tick]
        advantage = delta + settings.gamma * settings.lambda_ * advantage
        estimates[tick] = advantage
        next_value = values[tick]
    estimates = estimates.to(rollout.values.device)
    return estimates, estimates + rollout.values


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
) -> UpdateMetrics:
    """The metrics of one update of `policy`; `progress` in 0..1 is how much of the run is over.

    Source: Schulman et al. 2017 (arXiv:1707.06347), eq. 7 and 9; advantages are normalised in each minibatch
    as in the code of Carroll et al. 2019.
    """
    device = rollout.actions.device
    advantage, returns = advantages(rollout, settings, shaping, bonus)
    explained = explained_variance(rollout.values, returns)
    seen = rollout.seen.flatten(0, 1)
    actions = rollout.actions.flatten()
    old_log_probabilities = rollout.log_probabilities.flatten()
    advantage, returns = advantage.flatten(), returns.flatten()

    entropy_weight = settings.entropy_start + progress * (settings.entropy_end - settings.entropy_start)
    for group in optimiser.param_groups:
        group["lr"] = settings.learning_rate * (1 - progress * (1 - settings.final_rate_share))

    def backward(replica: Policy, rows: torch.Tensor, advantage: torch.Tensor, size: int) -> torch.Tensor:
        """float32 [5]: the metrics of some rows of a minibatch of `size`; their gradients go to `replica`."""
        with torch.autocast(device.type, torch.bfloat16, enabled=machine.bf16):
            logits, values = replica(seen.index_select(0, rows))  # several times as quick as seen[rows]
        log_policy = functional.log_softmax(logits, dim=1)
        log_probability = log_policy.gather(1, actions[rows].unsqueeze(1)).squeeze(1)
        entropy = -(log_policy.exp() * log_policy).sum(dim=1)
        log_ratio = log_probability - old_log_probabilities[rows]
        ratio = log_ratio.exp()
        clipped = ratio.clamp(1 - settings.clip, 1 + settings.clip)
        policy_loss = -torch.minimum(ratio * advantage, clipped * advantage)
        value_loss = 0.5 * (values - returns[rows]).square()
        loss = policy_loss + settings.value_coefficient * value_loss - entropy_weight * entropy
        (loss.sum() / size).backward()
        clip_fraction, approx_kl = (ratio != clipped).float(), ratio - 1 - log_ratio
        metrics = (policy_loss, value_loss, entropy, clip_fraction, approx_kl)
        return torch.stack([one.detach().sum() for one in metrics]) / size

    generator = torch.Generator().manual_seed(seed)
    metrics = torch.zeros(5, device=device)
    with Replicas(policy, machine) as replicas:
        for _ in range(settings.epochs):
            order = torch.randperm(len(actions), generator=generator).to(device)
            for rows in order.chunk(settings.minibatches):
                normalised = advantage[rows]
                normalised = (normalised - normalised.mean()) / (normalised.std() + 1e-8)
                optimiser.zero_grad(set_to_none=True)
                metrics += replicas.add_gradients(backward, rows, normalised)
                torch.nn.utils.clip_grad_norm_(policy.parameters(), settings.max_gradient_norm)
                optimiser.step()
    means = (metrics / (settings.epochs * settings.minibatches)).tolist()
    return UpdateMetrics(*[*means, explained])


def explained_variance(values: torch.Tensor, returns: torch.Tensor) -> float:
    """Share of the variance of `returns` that `values`, of the same shape, explain; NaN where there is none.

    Source: CleanRL, `ppo.py`.
    """
    variance = returns.var(correction=0)
    return float(1 - (returns - values).var(correction=0) / variance) if variance > 0 else math.nan


def adam(policy: Policy, settings: PPOSettings) -> torch.optim.Adam:
    """The optimiser of a policy."""
    return torch.optim.Adam(policy.parameters(), lr=settings.learning_rate, eps=1e-5, fused=True)


def shaping_weight(ticks: int, settings: PPOSettings) -> float:
    """The weight of the extra reward after `ticks` ticks of learning: 1 falling linearly to 0."""
    return max(0.0, 1 - ticks / settings.shaping_ticks) if settings.shaping_ticks > 0 else 0.0
