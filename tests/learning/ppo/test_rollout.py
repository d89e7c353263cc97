"""Episodes of a learner beside partners."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from galley.agents import choosing
from galley.errors import GalleyError
from galley.kitchen import Encoder, Kitchen, KitchenBatch
from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.games import games_with
from galley.learning.ppo.rollout import Episodes, Pairing, choose, derived_seed
from tests.learning.kitchens import CPU, SMALL, Always, policy


def test_what_is_recorded_is_what_the_rules_make_of_the_actions() -> None:
    learner, partner = policy(1), policy(2)
    episodes = Episodes(SMALL, 6, CPU)
    rollout = episodes.play(learner, [Pairing(None, 2), Pairing(partner, 4)], 5, both=True)
    encoder = Encoder(SMALL, "grid")
    assert rollout.seats.tolist() == [0, 1, 0, 1, 0, 1, 1, 0]
    assert rollout.kitchens.tolist() == [0, 1, 2, 3, 4, 5, 0, 1]
    for row, again in ((0, 6), (1, 7)):  # both seats of the kitchens played with itself are on record
        kitchen = Kitchen(SMALL)
        for tick in range(SMALL.rules.horizon_ticks):
            for index in (row, again):
                seen = encoder.seat(kitchen.state[np.newaxis], int(rollout.seats[index]))[0]
                assert np.array_equal(seen, rollout.seen[tick, index].numpy())
            actions = {int(rollout.seats[one]): int(rollout.actions[tick, one]) for one in (row, again)}
            assert kitchen.step(actions[0], actions[1]) == rollout.rewards[tick, row]


def test_the_extra_reward_is_told_by_whose_deed_it_is_for() -> None:
    layout = SMALL.with_rules(horizon_ticks=300)
    batch = KitchenBatch(layout, 40)
    rollout = Episodes(layout, 40, CPU).play(policy(1), [Pairing(None, 40)], 5, both=True)
    joint = np.empty((300, 40, 2), dtype=np.int64)
    for row, (kitchen, seat) in enumerate(zip(rollout.kitchens, rollout.seats, strict=True)):
        joint[:, kitchen, seat] = rollout.actions[:, row].numpy()
    paid = []
    for actions in joint:
        batch.step(actions)
        paid.append(batch.shaping().copy())
    wanted = np.array(paid)
    assert wanted.sum() > 0
    own, other = rollout.shaping.numpy()
    assert np.array_equal(own, wanted[:, rollout.kitchens, rollout.seats])
    assert np.array_equal(other, wanted[:, rollout.kitchens, 1 - rollout.seats])


def test_log_probabilities_and_values_are_the_learners() -> None:
    learner = policy(1)
    rollout = Episodes(SMALL, 4, CPU).play(learner, [Pairing(policy(2), 4)], 1)
    logits, values = learner(rollout.seen.flatten(0, 1))
    taken = logits.log_softmax(1).gather(1, rollout.actions.flatten().unsqueeze(1)).squeeze(1)
    torch.testing.assert_close(rollout.log_probabilities.flatten(), taken, rtol=1e-4, atol=1e-6)
    torch.testing.assert_close(rollout.values.flatten(), values, rtol=1e-4, atol=1e-6)


def test_equal_seeds_give_equal_rollouts_and_others_do_not() -> None:
    episodes = Episodes(SMALL, 8, CPU)
    first, same, other = (episodes.play(policy(1), [Pairing(None, 8)], seed) for seed in (1, 1, 2))
    assert torch.equal(first.actions, same.actions)
    assert not torch.equal(first.actions, other.actions)


def test_threads_change_nothing_but_rounding() -> None:
    pairings = [Pairing(None, 4), Pairing(policy(2), 4), Pairing(policy(3), 4)]
    for given in (pairings, [Pairing(None, 12)]):
        made = [
            Episodes(SMALL, 12, Machine(CPU.device, threads)).play(policy(1), given, 1, both=True)
            for threads in (1, 2, 3)
        ]
        for other in made[1:]:
            assert torch.equal(made[0].actions, other.actions)
            torch.testing.assert_close(made[0].values, other.values, rtol=1e-4, atol=1e-6)


def test_partners_play_the_other_seat() -> None:
    rollout = Episodes(SMALL, 2, CPU).play(Always(4), [Pairing(Always(2), 2)], 1)
    other_cell = rollout.seen[:, 0, 1].flatten(1).argmax(dim=1).tolist()  # of seat 1, which starts at (3, 2)
    assert set(other_cell) == {2 * 5 + 3}  # blocked by the counter at once
    other_cell = rollout.seen[:, 1, 1].flatten(1).argmax(dim=1).tolist()  # of seat 0, which walks east
    assert other_cell[:4] == [1 * 5 + 1, 1 * 5 + 2, 1 * 5 + 3, 1 * 5 + 3]


def test_sampling_by_inversion_follows_the_probabilities() -> None:
    logits = torch.log(torch.tensor([[0.5, 0.2, 0.1, 0.1, 0.05, 0.05]]))
    draws = torch.linspace(0, 1, 20001)[:-1]
    found = choose(logits.expand(len(draws), 6), draws)
    shares = torch.bincount(found, minlength=6) / len(draws)
    torch.testing.assert_close(shares, torch.tensor([0.5, 0.2, 0.1, 0.1, 0.05, 0.05]), atol=2e-4, rtol=0)


def test_games_with_partners_are_told_by_seat() -> None:
    scores = games_with(SMALL, policy(1), [policy(2), Always(4), policy(1)], 3, 7, CPU)
    assert scores.shape == (3, 2, 3)
    again = games_with(SMALL, policy(1), [policy(2), Always(4), policy(1)], 3, 7, CPU)
    assert np.array_equal(scores, again)


def test_order_lists_are_refused() -> None:
    with pytest.raises(GalleyError, match="may not have `orders`"):
        Episodes(SMALL.with_rules(orders=("onion",)), 2, CPU)


def test_pairings_must_share_out_all_kitchens() -> None:
    with pytest.raises(ValueError, match="share out 4 kitchens"):
        Episodes(SMALL, 4, CPU).play(policy(1), [Pairing(None, 3)], 1)


def test_derived_seeds_differ_by_any_part() -> None:
    seeds = {derived_seed(*parts) for parts in ((1,), (2,), (1, 0), (1, 1), (1, 1, 0), (-1,), (1 << 40,))}
    assert len(seeds) == 7
    assert all(0 <= seed < 1 << 63 for seed in seeds)


def test_training_draws_actions_as_agents_do() -> None:
    generator = np.random.default_rng(6)
    logits = generator.normal(0, 2, (2000, 6)).astype(np.float32)
    draws = generator.random(2000, dtype=np.float32)
    here = choose(torch.from_numpy(logits), torch.from_numpy(draws)).numpy()
    there = choosing.choose(logits, np.zeros(logits.shape, dtype=np.bool_), draws.astype(np.float64))
    assert here.tolist() == there.tolist()
