"""Behaviour cloning: a small network that predicts what people did."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from galley.kitchen import ACTIONS

Layer = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Weights [out, in] and biases [out] of one dense layer."""


@dataclass(frozen=True)
class CloningSettings:
    """How a clone is trained.

    Source: Carroll et al. 2019 (arXiv:1910.05789) and its published code, which names epochs, learning rate,
    held-out share and network; batch size and initial weights are those of the Stable Baselines library that
    it trained with.
    """

    epochs: int
    """Passes over the training rows; the weights after the last one are kept."""
    hidden: tuple[int, ...] = (64, 64)
    """Widths of the tanh layers."""
    learning_rate: float = 1e-3
    """Of Adam, whose other settings are PyTorch's."""
    batch: int = 64
    """Rows in one update; what is left over at the end of a pass is dropped."""
    held_out: float = 0.15
    """Share of rows, drawn at random, that is not trained on and gives the held-out accuracy."""
    output_gain: float = 0.01
    """Gain of the last layer's orthogonal start, so that all actions begin equally probable."""


@dataclass(frozen=True)
class Clone:
    """A trained network, and how often its most probable action was the one taken."""

    layers: tuple[Layer, ...]
    rows: int
    train_accuracy: float
    held_out_accuracy: float
    held_out_loss: float


def train_clone(
    observations: NDArray[np.float32], actions: NDArray[np.integer], settings: CloningSettings, seed: int
) -> Clone:
    """The clone of `actions` (codes, [T]) on `observations` (float32 [T, F]); equal seeds, equal clones.

    PyTorch runs on one thread, so that the result does not hang on the number of cores.
    """
    torch.set_num_threads(1)
    generator = torch.Generator().manual_seed(seed)
    inputs = torch.from_numpy(np.ascontiguousarray(observations, dtype=np.float32))
    targets = torch.from_numpy(np.ascontiguousarray(actions, dtype=np.int64))
    order = torch.randperm(len(inputs), generator=generator)
    kept = len(order) - round(settings.held_out * len(order))
    training, held_out = order[:kept], order[kept:]
    network = _network(inputs.shape[1], settings, generator)
    optimiser = torch.optim.Adam(network.parameters(), lr=settings.learning_rate, fused=True)
    loss_of = nn.CrossEntropyLoss()
    for _ in range(settings.epochs):
        for rows in _batches(training, settings.batch, generator):
            optimiser.zero_grad(set_to_none=True)
            loss_of(network(inputs[rows]), targets[rows]).backward()
            optimiser.step()
    with torch.no_grad():
        logits = network(inputs)
        right = (logits.argmax(dim=1) == targets).float()
        loss = loss_of(logits[held_out], targets[held_out])
    dense = [layer for layer in network if isinstance(layer, nn.Linear)]
    return Clone(
        layers=tuple((layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in dense),
        rows=len(inputs),
        train_accuracy=float(right[training].mean()),
        held_out_accuracy=float(right[held_out].mean()),
        held_out_loss=float(loss),
    )


def _network(features: int, settings: CloningSettings, generator: torch.Generator) -> nn.Sequential:
    """Dense layers with tanh between them, orthogonal weights and no bias at the start."""
    sizes = [features, *settings.hidden, len(ACTIONS)]
    layers: list[nn.Module] = []
    for place, (before, after) in enumerate(pairwise(sizes)):
        last = place == len(sizes) - 2
        dense = nn.Linear(before, after)
        nn.init.orthogonal_(dense.weight, settings.output_gain if last else 2.0**0.5, generator=generator)
        nn.init.zeros_(dense.bias)
        layers += [dense] if last else [dense, nn.Tanh()]
    return nn.Sequential(*layers)


def _batches(rows: torch.Tensor, size: int, generator: torch.Generator) -> Iterator[torch.Tensor]:
    """The rows in a new order, in batches of one size; fewer rows than one batch come as they are."""
    shuffled = rows[torch.randperm(len(rows), generator=generator)]
    if len(shuffled) < size:
        yield shuffled
        return
    for start in range(0, len(shuffled) - size + 1, size):
        yield shuffled[start : start + size]
