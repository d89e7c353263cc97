"""PPO's numbers against their formulas, and that it learns."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
import torch

from galley.errors import GalleyError
from galley.kitchen import Layout
from galley.learning.methods.self_play import SelfPlay
from galley.learning.ppo.constants import PPOSettings
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.learner import Learner
from galley.learning.ppo.rollout import Episodes, Pairing, Rollout
from galley.learning.ppo.update import adam, advantages, explained_variance, shaping_weight, update
from tests.learning.kitchens import CPU, QUICK, SMALL


def rollout_of(rewards: list[float], values: list[float]) -> Rollout:
    column = torch.tensor(rewards).unsqueeze(1)
    return Rollout(
        seen=torch.zeros(len(rewards), 1, 26, 4, 5, dtype=torch.uint8),
        actions=torch.zeros(len(rewards), 1, dtype=torch.int64),
        log_probabilities=torch.zeros_like(column),
        values=torch.tensor(values).unsqueeze(1),
        rewards=column,
        shaping=torch.stack([torch.ones_like(column), torch.full_like(column, 4.0)]),
        seats=np.zeros(1, dtype=np.int64),
        kitchens=np.zeros(1, dtype=np.int64),
        scores=np.zeros(1, dtype=np.int64),
    )


def test_advantages_are_the_sum_of_discounted_surprises() -> None:
    settings = PPOSettings(gamma=0.9, lambda_=0.7, reward_scale=0.5, partner_shaping=0.5)
    rewards, values = [0.0, 20.0, 0.0, 20.0], [1.0, 2.0, -1.0, 0.5]
    found, returns = advantages(rollout_of(rewards, values), settings, shaping=0.25)
    paid = [0.5 * (reward + 0.25 * (1 + 0.5 * 4)) for reward in rewards]
    following = [*values[1:], 0.0]
    surprises = [
        reward + 0.9 * later - value for reward, later, value in zip(paid, following, values, strict=True)
    ]
    wanted = [
        sum((0.9 * 0.7) ** ahead * surprises[tick + ahead] for ahead in range(4 - tick)) for tick in range(4)
    ]
    np.testing.assert_allclose(found.flatten().numpy(), wanted, rtol=1e-6)
    np.testing.assert_allclose(returns.flatten().numpy(), np.add(wanted, values), rtol=1e-6)


def test_explained_variance_is_the_share_that_the_values_explain() -> None:
    returns = torch.tensor([[1.0, 2.0], [3.0, 4.0]])
    assert explained_variance(returns + 7.0, returns) == pytest.approx(1.0)
    assert explained_variance(torch.zeros(2, 2), returns) == pytest.approx(0.0)
    assert explained_variance(torch.tensor([[1.0, 2.0], [3.0, 2.0]]), returns) == pytest.approx(
        1 - 0.75 / 1.25
    )
    assert math.isnan(explained_variance(returns, torch.ones(2, 2)))


def test_with_lambda_1_returns_are_what_was_paid() -> None:
    settings = PPOSettings(gamma=1.0, lambda_=1.0, reward_scale=1.0)
    _, returns = advantages(rollout_of([1.0, 0.0, 3.0], [5.0, -2.0, 8.0]), settings, shaping=0.0)
    np.testing.assert_allclose(returns.flatten().numpy(), [4.0, 3.0, 3.0], rtol=1e-6)


def test_a_bonus_is_paid_unscaled() -> None:
    settings = PPOSettings(gamma=1.0, lambda_=1.0, reward_scale=0.1)
    bonus = torch.tensor([[1.0], [2.0]])
    _, returns = advantages(rollout_of([10.0, 10.0], [0.0, 0.0]), settings, shaping=0.0, bonus=bonus)
    np.testing.assert_allclose(returns.flatten().numpy(), [5.0, 3.0], rtol=1e-6)


def test_threads_share_a_minibatch_and_change_nothing_but_rounding() -> None:
    learner = Learner(SMALL, QUICK, 5, 1, CPU)
    rollout = Episodes(SMALL, 8, CPU).play(learner.policy, [Pairing(None, 8)], 1)
    made = []
    for threads in (1, 2, 3, 3):
        policy = copy.deepcopy(learner.policy)
        update(
            policy,
            adam(policy, QUICK),
            rollout,
            QUICK,
            progress=0,
            shaping=1,
            seed=3,
            machine=Machine(CPU.device, threads),
        )
        made.append(torch.cat([parameter.detach().flatten() for parameter in policy.parameters()]))
    torch.testing.assert_close(made[0], made[1], rtol=0, atol=2e-4)
    torch.testing.assert_close(made[0], made[2], rtol=0, atol=2e-4)
    assert torch.equal(made[2], made[3])


def test_rate_and_entropy_fall_along_the_run() -> None:
    settings = QUICK.changed(final_rate_share=0.1)
    learner = Learner(SMALL, settings, 5, 1, CPU)
    rollout = Episodes(SMALL, 8, CPU).play(learner.policy, [Pairing(None, 8)], 1)
    update(learner.policy, learner.optimiser, rollout, settings, progress=0.5, shaping=1, seed=3, machine=CPU)
    assert learner.optimiser.param_groups[0]["lr"] == pytest.approx(1e-3 * 0.55)


def test_shaping_falls_to_nothing() -> None:
    settings = PPOSettings(shaping_ticks=1000)
    assert [shaping_weight(ticks, settings) for ticks in (0, 250, 1000, 5000)] == [1.0, 0.75, 0.0, 0.0]
    assert shaping_weight(0, PPOSettings(shaping_ticks=0)) == 0.0


def test_constants_that_cannot_be_are_named() -> None:
    with pytest.raises(GalleyError, match=r"clip is -1; .*") as raised:
        PPOSettings().changed(clip=-1, epochs=0)
    assert "epochs is 0" in str(raised.value)


def test_self_play_learns_what_pays() -> None:
    """An onion in reach of each chef, pots beside them: thirty small updates must beat chance by far."""
    corridor = Layout.from_ascii("corridor", "XPXPX\nO1 2O\nXDSDX", cook_time_ticks=2, horizon_ticks=30)
    settings = QUICK.changed(
        ticks=30 * 16, epochs=4, learning_rate=3e-3, entropy_start=0.01, shaping_ticks=1e6
    )
    training = SelfPlay(corridor, settings, 30, 0, CPU)
    shaping = [training.step().row["shaping"] for _ in range(30)]
    assert np.mean(shaping[-5:]) > 3 * np.mean(shaping[:5])
