"""A minibatch worked out by several threads, each on its own copy of the policy."""

from __future__ import annotations

import copy
from collections.abc import Callable
from types import TracebackType
from typing import Self

import torch

from galley.learning.ppo.forwards import Machine
from galley.learning.ppo.policy import Policy

Pass = Callable[[Policy, torch.Tensor, torch.Tensor, int], torch.Tensor]


class Replicas:
    """A policy and copies of it, one a thread, that share out the rows of minibatches.

    Two threads with a part of the rows each are faster than two threads in every layer: they meet once a
    minibatch instead of at each operation. Gradients are added in the order of the parts, so that equal
    numbers of threads give equal results.
    """

    def __init__(self, policy: Policy, machine: Machine) -> None:
        self._pool = machine.pool()
        copies = 0 if self._pool is None else machine.threads - 1
        self.policies = [policy, *(copy.deepcopy(policy) for _ in range(copies))]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def add_gradients(self, backward: Pass, rows: torch.Tensor, advantage: torch.Tensor) -> torch.Tensor:
        """The sum of what `backward(policy, rows, advantage, size)` gives for all parts of a minibatch.

        The gradients of all parts are added to those of the policy itself.
        """
        first, *others = self.policies
        if self._pool is None:
            return backward(first, rows, advantage, len(rows))
        own: list[torch.Tensor] = list(first.parameters())
        for other in others:
            other.zero_grad(set_to_none=True)
            with torch.no_grad():
                torch._foreach_copy_([*other.parameters()], own)
        parts = len(self.policies)
        size = [len(rows)] * parts
        found = list(
            self._pool.map(
                backward, self.policies, rows.tensor_split(parts), advantage.tensor_split(parts), size
            )
        )
        for other in others:
            for one, more in zip(own, other.parameters(), strict=True):
                if one.grad is not None and more.grad is not None:
                    one.grad += more.grad
        return torch.stack(found).sum(dim=0)
