"""Whole episodes of a learner beside partners of many kinds, many kitchens at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import ACTIONS, Encoder, KitchenBatch, Layout
from galley.learning.forwards import Forwards, Machine, Ready
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


@dataclass(frozen=True)
class _Table:
    """Who plays where: the learner's seat in each kitchen, `own` kitchens where it sits on both.

    `mine` uint8 [kitchens + own, 26, H, W] is what the learner sees, first in its seats, then in the others
    of `own`; `across` [kitchens, ...] what the other seats see, of which each partner has a slice.
    """

    learner: Ready
    seats: NDArray[np.int64]
    own: NDArray[np.int64]
    mine: torch.Tensor
    across: torch.Tensor
    partners: list[tuple[Ready, slice]]


class Episodes:
    """A place to play: `kitchens` kitchens of one layout from reset to horizon.

    Raises:
        GalleyError: the layout has an order list, with which episodes would end at different ticks.
    """

    def __init__(self, layout: Layout, kitchens: int, machine: Machine) -> None:
        if layout.rules.orders is not None:
            raise GalleyError(
                f"layout {layout.name}: learning plays whole episodes, so its rules may not have `orders`; "
                "remove them from a copy of the layout"
            )
        self.layout = layout
        self.device = machine.device
        self.forwards = Forwards(machine)
        self.encoder = Encoder(layout, ENCODING)
        self.horizon = layout.rules.horizon_ticks
        self.batch = KitchenBatch(layout, kitchens)

    @torch.inference_mode()
    def play(self, learner: Policy, pairings: Sequence[Pairing], seed: int, *, both: bool = False) -> Rollout:
        """The learner's ticks in one episode of every kitchen.

        The kitchens are dealt to the pairings in order, seats alternating within each. With `both`, whoever
        plays with itself learns from both seats. Equal seeds, policies and pairings give equal rollouts.
        """
        table = self._table(learner, pairings)
        size = self.batch.size
        rows = len(table.mine) if both else size
        kitchens = np.concatenate([np.arange(size), table.own])[:rows]
        draws = self._draws(seed)
        seen = torch.empty((self.horizon, rows, *self.encoder.shape), dtype=torch.uint8)
        actions = torch.empty(self.horizon, rows, dtype=torch.int64, device=self.device)
        logits = torch.empty(self.horizon, rows, len(ACTIONS), device=self.device)
        values = torch.empty(self.horizon, rows, device=self.device)
        rewards = np.empty((self.horizon, size), dtype=np.float32)
        shaping = np.empty((self.horizon, size), dtype=np.float32)
        self.batch.reset()
        for tick in range(self.horizon):
            here, worth, there = self._ask(table)
            seen[tick] = table.mine[:rows]
            logits[tick], values[tick] = here[:rows], worth[:rows]
            chosen = choose(here[:size], draws[tick, 0])
            answered = choose(there, draws[tick, 1])
            actions[tick] = torch.cat([chosen, answered[table.own]])[:rows]
            rewards[tick] = self._step(table.seats, chosen, answered)
            shaping[tick] = self.batch.shaping().sum(axis=1)
        taken = torch.log_softmax(logits, dim=2).gather(2, actions.unsqueeze(2)).squeeze(2)
        return Rollout(
            seen=seen,
            actions=actions,
            log_probabilities=taken,
            values=values,
            rewards=torch.from_numpy(rewards[:, kitchens]).to(self.device),
            shaping=torch.from_numpy(shaping[:, kitchens]).to(self.device),
            seats=np.concatenate([table.seats, 1 - table.seats[table.own]])[:rows],
            kitchens=kitchens,
            scores=rewards.sum(axis=0).astype(np.int64),
        )

    @torch.inference_mode()
    def scores(self, policy: Policy, pairings: Sequence[Pairing], seed: int) -> NDArray[np.int64]:
        """int64 [kitchens]: the scores of one episode of every kitchen, dealt and drawn as in `play`."""
        table = self._table(policy, pairings)
        draws = self._draws(seed)
        self.batch.reset()
        for tick in range(self.horizon):
            here, _, there = self._ask(table)
            chosen = choose(here[: self.batch.size], draws[tick, 0])
            self._step(table.seats, chosen, choose(there, draws[tick, 1]))
        return self.batch.scores.astype(np.int64)

    def _table(self, learner: Policy, pairings: Sequence[Pairing]) -> _Table:
        """Who plays where.

        Raises:
            ValueError: the pairings do not share out all kitchens.
        """
        size = self.batch.size
        if sum(pairing.kitchens for pairing in pairings) != size:
            raise ValueError(f"pairings must share out {size} kitchens")
        own = np.flatnonzero(np.concatenate([np.full(one.kitchens, one.partner is None) for one in pairings]))
        mine = torch.empty((size + len(own), *self.encoder.shape), dtype=torch.uint8)
        across = torch.empty((size, *self.encoder.shape), dtype=torch.uint8)
        starts = np.cumsum([0, *(pairing.kitchens for pairing in pairings)])
        partners = [
            (Ready(pairing.partner), slice(start, start + pairing.kitchens))
            for pairing, start in zip(pairings, starts.tolist(), strict=False)
            if pairing.partner is not None
        ]
        return _Table(Ready(learner), alternating(pairings), own, mine, across, partners)

    def _ask(self, table: _Table) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """The learner's logits [kitchens + own, 6] and values, and the partners' logits [kitchens, 6]."""
        size = self.batch.size
        self.encoder.seat(self.batch.states, table.seats, table.mine[:size].numpy())
        self.encoder.seat(self.batch.states, 1 - table.seats, table.across.numpy())
        table.mine[size:] = table.across[table.own]
        parts = table.mine.tensor_split(1 if table.partners else self.forwards.threads)
        found = self.forwards(
            [
                *((table.learner, part) for part in parts),
                *((partner, table.across[part]) for partner, part in table.partners),
            ]
        )
        here = torch.cat([logits for logits, _ in found[: len(parts)]])
        worth = torch.cat([values for _, values in found[: len(parts)]])
        there = torch.empty(size, len(ACTIONS), device=self.device)
        there[table.own] = here[size:]
        for (_, part), (logits, _) in zip(table.partners, found[len(parts) :], strict=True):
            there[part] = logits
        return here, worth, there

    def _draws(self, seed: int) -> torch.Tensor:
        """float32 [T, 2, kitchens] in [0, 1): for the learner and for the partner of each kitchen."""
        generator = torch.Generator(self.device).manual_seed(seed)
        shape = (self.horizon, 2, self.batch.size)
        return torch.rand(shape, generator=generator, device=self.device)

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
