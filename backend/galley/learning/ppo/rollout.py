"""Whole episodes of a learner beside partners of many kinds, many kitchens at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from galley.errors import GalleyError
from galley.kitchen import ACTIONS, Encoder, KitchenBatch, Layout
from galley.learning.ppo.forwards import Forwards, Machine, Ready
from galley.learning.ppo.policy import ENCODING, Policy


@dataclass(frozen=True)
class Pairing:
    """How many kitchens the learner shares with one partner; None is the learner itself."""

    partner: Policy | None
    kitchens: int


@dataclass
class Rollout:
    """What the learner saw, did and got: T ticks in N rows, a row being one seat of one kitchen.

    `seen` uint8 [T, N, 26, H, W], `actions` int64, `log_probabilities`, `values` and `rewards` (sparse)
    float32, all [T, N]; `shaping` float32 [2, T, N] for the row's own deeds and for those of the other seat;
    `seats` int64 [N]; `scores` int64 [kitchens]; `kitchens` int64 [N].
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

    `sides` uint8 [2, kitchens, 26, H, W] is what the learner's seats and the others see, on the host. All
    other tensors are on the device: `mine` [kitchens + own, ...] what the learner sees, first in its seats,
    then in the others of `own`; `across` [kitchens, ...] what the other seats see, of which each partner has
    a slice; `draws` float32 [2, kitchens] for the learner and for the partner of each kitchen.
    """

    learner: Ready
    seats: NDArray[np.int64]
    own: torch.Tensor
    sides: torch.Tensor
    mine: torch.Tensor
    across: torch.Tensor
    draws: torch.Tensor
    partners: list[tuple[Ready, slice]]


@dataclass(frozen=True)
class _Answers:
    """Of a tick, on the device: `logits` [kitchens + own, 6], `values` and `actions` of the learner's rows.

    `joint` int64 [kitchens, 2] is what the learner chose and what the other seat answered.
    """

    logits: torch.Tensor
    values: torch.Tensor
    actions: torch.Tensor
    joint: torch.Tensor


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
        own = table.own.cpu().numpy()
        rows = len(table.mine) if both else size
        kitchens = np.concatenate([np.arange(size), own])[:rows]
        seats = np.concatenate([table.seats, 1 - table.seats[own]])[:rows]
        seen = torch.empty((self.horizon, rows, *self.encoder.shape), dtype=torch.uint8, device=self.device)
        actions = torch.empty(self.horizon, rows, dtype=torch.int64, device=self.device)
        logits = torch.empty(self.horizon, rows, len(ACTIONS), device=self.device)
        values = torch.empty(self.horizon, rows, device=self.device)
        rewards = np.empty((self.horizon, size), dtype=np.float32)
        shaping = np.empty((self.horizon, size, 2), dtype=np.float32)
        self.batch.reset()
        for tick, answers in enumerate(self._ticks(table, seed)):
            seen[tick] = table.mine[:rows]
            logits[tick], values[tick] = answers.logits[:rows], answers.values[:rows]
            actions[tick] = answers.actions[:rows]
            rewards[tick] = self._step(table.seats, answers)
            shaping[tick] = self.batch.shaping()
        taken = torch.log_softmax(logits, dim=2).gather(2, actions.unsqueeze(2)).squeeze(2)
        return Rollout(
            seen=seen,
            actions=actions,
            log_probabilities=taken,
            values=values,
            rewards=torch.from_numpy(rewards[:, kitchens]).to(self.device),
            shaping=torch.from_numpy(
                np.stack([shaping[:, kitchens, seats], shaping[:, kitchens, 1 - seats]])
            ).to(self.device),
            seats=seats,
            kitchens=kitchens,
            scores=rewards.sum(axis=0).astype(np.int64),
        )

    @torch.inference_mode()
    def scores(self, policy: Policy, pairings: Sequence[Pairing], seed: int) -> NDArray[np.int64]:
        """int64 [kitchens]: the scores of one episode of every kitchen, dealt and drawn as in `play`."""
        table = self._table(policy, pairings)
        self.batch.reset()
        for answers in self._ticks(table, seed):
            self._step(table.seats, answers)
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
        shape, device = self.encoder.shape, self.device
        starts = np.cumsum([0, *(pairing.kitchens for pairing in pairings)])
        return _Table(
            learner=Ready(learner),
            seats=alternating(pairings),
            own=torch.from_numpy(own).to(device),
            sides=torch.empty((2, size, *shape), dtype=torch.uint8, pin_memory=device.type == "cuda"),
            mine=torch.zeros((size + len(own), *shape), dtype=torch.uint8, device=device),
            across=torch.zeros((size, *shape), dtype=torch.uint8, device=device),
            draws=torch.zeros((2, size), device=device),
            partners=[
                (Ready(pairing.partner), slice(start, start + pairing.kitchens))
                for pairing, start in zip(pairings, starts.tolist(), strict=False)
                if pairing.partner is not None
            ],
        )

    def _ticks(self, table: _Table, seed: int) -> Iterator[_Answers]:
        """The answers of all ticks from now on; each is good until the next is asked for."""
        size = self.batch.size
        generator = torch.Generator(self.device).manual_seed(seed)
        draws = torch.rand((self.horizon, *table.draws.shape), generator=generator, device=self.device)
        ask = self.forwards.again(lambda: self._ask(table))
        for tick in range(self.horizon):
            for side, seats in enumerate((table.seats, 1 - table.seats)):
                self.encoder.seat(self.batch.states, seats, table.sides[side].numpy())
            table.mine[:size].copy_(table.sides[0], non_blocking=True)
            table.across.copy_(table.sides[1], non_blocking=True)
            table.draws.copy_(draws[tick])
            yield ask()

    def _ask(self, table: _Table) -> _Answers:
        """What everybody answers to what is on the table; only tensors of the device take part."""
        size = self.batch.size
        table.mine[size:] = table.across.index_select(0, table.own)
        parts = table.mine.tensor_split(1 if table.partners else self.forwards.threads)
        found = self.forwards(
            [
                *((table.learner, part) for part in parts),
                *((partner, table.across[part]) for partner, part in table.partners),
            ]
        )
        here = torch.cat([logits for logits, _ in found[: len(parts)]])
        there = torch.zeros(size, len(ACTIONS), device=self.device).index_copy_(0, table.own, here[size:])
        for (_, part), (logits, _) in zip(table.partners, found[len(parts) :], strict=True):
            there[part] = logits
        chosen, answered = choose(here[:size], table.draws[0]), choose(there, table.draws[1])
        return _Answers(
            logits=here,
            values=torch.cat([values for _, values in found[: len(parts)]]),
            actions=torch.cat([chosen, answered.index_select(0, table.own)]),
            joint=torch.stack([chosen, answered], dim=1),
        )

    def _step(self, seats: NDArray[np.int64], answers: _Answers) -> NDArray[np.int32]:
        """int32 [kitchens]: the rewards of a tick in which everybody does what was answered."""
        joint = answers.joint.cpu().numpy()
        first = seats[:, np.newaxis] == 0
        return self.batch.step(np.where(first, joint, joint[:, ::-1]))


def choose(logits: torch.Tensor, draws: torch.Tensor) -> torch.Tensor:
    """int64 [B]: an action for each row of `logits` [B, 6], by inversion with `draws` [B] in [0, 1).

    What `galley.agents.choosing.choose` does with nothing barred, in tensors that stay on their device.
    """
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
