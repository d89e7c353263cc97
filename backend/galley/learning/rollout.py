"""Whole episodes of a learner beside partners of many kinds, many kitchens at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import ACTIONS, Encoder, KitchenBatch, Layout
from galley.learning.policy import ENCODING, Policy


@dataclass(frozen=True)
class Pairing:
    """How many kitchens the learner shares with one partner; None is the learner itself."""

    partner: Policy | None
    kitchens: int


@dataclass
class Rollout:
    """What the learner saw, did and got: T ticks in N rows, a row being one seat of one kitchen.

    `seen` uint8 [T, N, 26, H, W], `actions` int64, `log_probabilities`, `values`, `rewards` (sparse) and
    `shaping` float32, all [T, N]; `seats` int64 [N]; `scores` int64 [kitchens]; `kitchens` int64 [N].
    """

    seen: torch.Tensor
    actions: torch.Tensor
    log_probabilities: torch.Tensor
    values: torch.Tensor
    rewards: torch.Tensor
    shaping: torch.Tensor
    seats: NDArray[np.int64]
    kitchens: NDArray[np.int64]
    scores: NDArray[np.int64]


class Episodes:
    """A place to play: `kitchens` kitchens of one layout from reset to horizon, buffers kept between calls.

    Raises:
        GalleyError: the layout has an order list, with which episodes would end at different ticks.
    """

    def __init__(self, layout: Layout, kitchens: int, device: torch.device) -> None:
        if layout.rules.orders is not None:
            raise GalleyError(
                f"layout {layout.name}: learning plays whole episodes, so its rules may not have `orders`; "
                "remove them from a copy of the layout"
            )
        self.layout = layout
        self.device = device
        self.encoder = Encoder(layout, ENCODING)
        self.horizon = layout.rules.horizon_ticks
        self.batch = KitchenBatch(layout, kitchens)
        self._across = np.empty((kitchens, *self.encoder.shape), dtype=np.uint8)

    @torch.inference_mode()
    def play(self, learner: Policy, pairings: Sequence[Pairing], seed: int, *, both: bool = False) -> Rollout:
        """The learner's ticks in one episode of every kitchen.

        The kitchens are dealt to the pairings in order, seats alternating within each. With `both`, whoever
        plays with itself learns from both seats. Equal seeds, policies and pairings give equal rollouts.
        """
        size = self._checked(pairings)
        seats = alternating(pairings)
        own = np.concatenate([np.full(one.kitchens, one.partner is None) for one in pairings])
        doubled = np.flatnonzero(own) if both else np.empty(0, dtype=np.int64)
        kitchens = np.concatenate([np.arange(size), doubled])
        rows = len(kitchens)
        draws = self._draws(seed)
        seen = torch.empty((self.horizon, rows, *self.encoder.shape), dtype=torch.uint8)
        actions = torch.empty(self.horizon, rows, dtype=torch.int64, device=self.device)
        logits = torch.empty(self.horizon, rows, len(ACTIONS), device=self.device)
        values = torch.empty(self.horizon, rows, device=self.device)
        rewards = np.empty((self.horizon, size), dtype=np.float32)
        shaping = np.empty((self.horizon, size), dtype=np.float32)
        self.batch.reset()
        for tick in range(self.horizon):
            view = seen[tick].numpy()
            self.encoder.seat(self.batch.states, seats, view[:size])
            self.encoder.seat(self.batch.states, 1 - seats, self._across)
            view[size:] = self._across[doubled]
            there = self._partners(learner, pairings, skip_own=both)
            logits[tick], values[tick] = learner(seen[tick].to(self.device))
            there[doubled] = logits[tick, size:]
            chosen = choose(logits[tick, :size], draws[tick, 0])
            answered = choose(there, draws[tick, 1])
            actions[tick, :size] = chosen
            actions[tick, size:] = answered[doubled]
            rewards[tick] = self._step(seats, chosen, answered)
            shaping[tick] = self.batch.shaping().sum(axis=1)
        taken = torch.log_softmax(logits, dim=2).gather(2, actions.unsqueeze(2)).squeeze(2)
        return Rollout(
            seen=seen,
            actions=actions,
            log_probabilities=taken,
            values=values,
            rewards=torch.from_numpy(rewards[:, kitchens]).to(self.device),
            shaping=torch.from_numpy(shaping[:, kitchens]).to(self.device),
            seats=np.concatenate([seats, 1 - seats[doubled]]),
            kitchens=kitchens,
            scores=rewards.sum(axis=0).astype(np.int64),
        )

    @torch.inference_mode()
    def scores(self, policy: Policy, pairings: Sequence[Pairing], seed: int) -> NDArray[np.int64]:
        """int64 [kitchens]: the scores of one episode of every kitchen, dealt and drawn as in `play`."""
        size = self._checked(pairings)
        seats = alternating(pairings)
        draws = self._draws(seed)
        seen = np.empty((size, *self.encoder.shape), dtype=np.uint8)
        self.batch.reset()
        for tick in range(self.horizon):
            self.encoder.seat(self.batch.states, seats, seen)
            self.encoder.seat(self.batch.states, 1 - seats, self._across)
            there = self._partners(policy, pairings, skip_own=False)
            here = policy(torch.from_numpy(seen).to(self.device))[0]
            self._step(seats, choose(here, draws[tick, 0]), choose(there, draws[tick, 1]))
        return self.batch.scores.astype(np.int64)

    def _checked(self, pairings: Sequence[Pairing]) -> int:
        size = self.batch.size
        if sum(pairing.kitchens for pairing in pairings) != size:
            raise ValueError(f"pairings must share out {size} kitchens")
        return size

    def _draws(self, seed: int) -> torch.Tensor:
        """float32 [T, 2, kitchens] in [0, 1): for the learner and for the partner of each kitchen."""
        generator = torch.Generator(self.device).manual_seed(seed)
        shape = (self.horizon, 2, self.batch.size)
        return torch.rand(shape, generator=generator, device=self.device)

    def _partners(self, learner: Policy, pairings: Sequence[Pairing], *, skip_own: bool) -> torch.Tensor:
        """float32 [kitchens, 6]: the partners' logits for what they see; the learner's may be left out."""
        across = torch.from_numpy(self._across).to(self.device)
        logits = torch.empty(self.batch.size, len(ACTIONS), device=self.device)
        start = 0
        for pairing in pairings:
            part = slice(start, start + pairing.kitchens)
            start += pairing.kitchens
            if pairing.partner is not None or not skip_own:
                logits[part] = (pairing.partner or learner)(across[part])[0]
        return logits

    def _step(
        self, seats: NDArray[np.int64], chosen: torch.Tensor, answered: torch.Tensor
    ) -> NDArray[np.int32]:
        """int32 [kitchens]: the rewards of a tick in which the learner chose and the partners answered."""
        joint = torch.stack([chosen, answered], dim=1).cpu().numpy()
        first = seats[:, np.newaxis] == 0
        return self.batch.step(np.where(first, joint, joint[:, ::-1]))


def choose(logits: torch.Tensor, draws: torch.Tensor) -> torch.Tensor:
    """int64 [B]: an action for each row of `logits` [B, 6], by inversion with `draws` [B] in [0, 1)."""
    reached = torch.softmax(logits, dim=1).cumsum(dim=1)
    return (reached[:, :-1] <= draws.unsqueeze(1)).sum(dim=1)


def alternating(pairings: Sequence[Pairing]) -> NDArray[np.int64]:
    """int64 [kitchens]: the learner's seat, 0 and 1 in turn within each pairing.

    Odd numbers of kitchens begin with seat 0 and seat 1 in turn, so that seats stay even overall.
    """
    seats = []
    first = 0
    for pairing in pairings:
        seats.append((np.arange(pairing.kitchens) + first) % 2)
        first = (first + pairing.kitchens) % 2
    return np.concatenate(seats).astype(np.int64)


def derived_seed(*parts: int) -> int:
    """A seed of 63 bits for one purpose: the same for the same whole numbers, unrelated for others."""
    words = [len(parts)]  # NumPy takes zeros at the end for nothing
    for part in parts:
        words += [part & 0xFFFFFFFF, part >> 32 & 0xFFFFFFFF]
    state = np.random.SeedSequence(words).generate_state(2, np.uint32)
    return (int(state[0]) << 31) ^ int(state[1])
