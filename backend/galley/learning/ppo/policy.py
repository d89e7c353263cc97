"""The policy network of the field's learned agents: three convolutions, three dense layers, two heads."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.nn import functional

from galley.kitchen import ACTIONS, Encoder, Layout
from galley.learning.ppo import sparse_kernel as kernels
from galley.learning.ppo.dense_kernel import Product, product

ENCODING = "grid"
FILTERS = 25
HIDDEN = 64
SLOPE = 0.2
_FIRST_KERNEL = 5
_NEXT_KERNEL = 3

Sparse = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Filters of the first convolution as the kernels want them, and the convolution of the map."""

Prepared = tuple[Sparse, torch.Tensor] | list[Product]
"""What is made of the weights.

On a CPU: of those of the first convolution, and of the first dense layer (`_turned`). On a GPU: the
convolutions as matrices.
"""


class _SparseConvolution(torch.autograd.Function):
    """The leaky ReLU of a "same" convolution on observations that differ little from a map."""

    @staticmethod
    def forward(
        ctx: Any,
        seen: torch.Tensor,
        map_: torch.Tensor,
        weight: torch.Tensor,
        bias: torch.Tensor,
        filters: NDArray[np.float32],
        of_map: NDArray[np.float32],
    ) -> torch.Tensor:
        channels, height, width = map_.shape
        count, size = weight.shape[0], weight.shape[2]
        observations = seen.reshape(len(seen), -1).numpy()
        flat_map = map_.reshape(-1).numpy()
        out = torch.empty(len(seen), height * width * count)
        kernels.convolve(observations, flat_map, filters, of_map, height, width, SLOPE, out.numpy())
        ctx.shape = (channels, size, count, height, width)
        ctx.kept = (observations, flat_map, out.numpy())
        return out.view(-1, height, width, count).permute(0, 3, 1, 2)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        channels, size, count, height, width = ctx.shape
        observations, flat_map, out = ctx.kept
        asked = gradients[0].permute(0, 2, 3, 1).reshape(len(out), -1).numpy()
        filters = np.zeros((channels, size, size * count), dtype=np.float32)
        rest = np.zeros(height * width * count, dtype=np.float32)
        kernels.convolve_back(observations, flat_map, out, asked, height, width, SLOPE, filters, rest)
        nothing, everywhere = np.zeros_like(flat_map), np.flatnonzero(flat_map).astype(np.int32)
        kernels.gather(flat_map, nothing, everywhere, rest, height, width, filters)
        weight = filters.reshape(channels, size, size, count)[:, :, ::-1].transpose(3, 0, 1, 2)
        bias = rest.reshape(-1, count).sum(axis=0)
        whole = torch.from_numpy(np.ascontiguousarray(weight))
        return None, None, whole, torch.from_numpy(bias), None, None


def _sparse(map_: torch.Tensor, layer: nn.Conv2d) -> Sparse:
    """The layer's filters as the kernels want them, and the convolution of the map."""
    channels, height, width = map_.shape
    size = layer.weight.shape[2]
    filters = np.ascontiguousarray(layer.weight.detach().numpy().transpose(1, 2, 3, 0)[:, :, ::-1])
    filters = filters.reshape(channels, size, -1)
    bias = np.zeros(len(layer.weight), np.float32) if layer.bias is None else layer.bias.detach().numpy()
    of_map = np.tile(bias, height * width)
    flat_map = map_.reshape(-1).numpy()
    nothing, everywhere = np.zeros_like(flat_map), np.flatnonzero(flat_map).astype(np.int32)
    kernels.spread(flat_map, nothing, everywhere, filters, height, width, of_map)
    return filters, of_map


class Policy(nn.Module):
    """A policy and a value for observations `grid` uint8 [B, 26, H, W] of one layout.

    Convolutions 5x5 and 3x3 "same" and 3x3 "valid" with 25 filters, dense layers of 64, leaky ReLU 0.2; the
    heads share them. On a CPU the first convolution makes use of sparse observations, and weights that stay
    as they are make all three matrices on a GPU, to the same result.

    Source: COLE paper, App. C; Carroll et al. 2019 (arXiv:1910.05789), App. C, for kernels and slope.
    """

    map: torch.Tensor

    def __init__(self, layout: Layout, generator: torch.Generator | None = None) -> None:
        super().__init__()
        height, width = layout.tiles.shape
        encoder = Encoder(layout, ENCODING)
        self.register_buffer("map", torch.from_numpy(encoder.map), persistent=False)
        inside = FILTERS * (height - _NEXT_KERNEL + 1) * (width - _NEXT_KERNEL + 1)
        self.first = nn.Conv2d(encoder.shape[0], FILTERS, _FIRST_KERNEL, padding=_FIRST_KERNEL // 2)
        self.second = nn.Conv2d(FILTERS, FILTERS, _NEXT_KERNEL, padding=_NEXT_KERNEL // 2)
        self.third = nn.Conv2d(FILTERS, FILTERS, _NEXT_KERNEL)
        self.dense = nn.ModuleList(
            [nn.Linear(inside, HIDDEN), nn.Linear(HIDDEN, HIDDEN), nn.Linear(HIDDEN, HIDDEN)]
        )
        self.logits = nn.Linear(HIDDEN, len(ACTIONS))
        self.value = nn.Linear(HIDDEN, 1)
        for layer in self.modules():
            if not isinstance(layer, (nn.Conv2d, nn.Linear)):
                continue
            gain = 0.01 if layer is self.logits else 1.0 if layer is self.value else 2.0**0.5
            nn.init.orthogonal_(layer.weight, gain, generator=generator)
            if layer.bias is not None:
                nn.init.zeros_(layer.bias)
        self.to(memory_format=torch.channels_last)

    def forward(
        self, seen: torch.Tensor, prepared: Prepared | None = None
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Logits float32 [B, 6] and values float32 [B] of observations uint8 [B, 26, H, W]."""
        weight: torch.Tensor
        weight, bias = self.dense[0].parameters()
        if isinstance(prepared, list):
            flow = seen.flatten(1).float()
            for matrix in prepared:
                flow = functional.leaky_relu(functional.linear(flow, *matrix), SLOPE, inplace=True)
        else:
            sparse, weight = prepared or (None, self._turned())
            flow = functional.leaky_relu(self.second(self._first(seen, sparse)), SLOPE, inplace=True)
            flow = functional.leaky_relu(self.third(flow), SLOPE, inplace=True)
            flow = flow.permute(0, 2, 3, 1).flatten(1)
        flow = functional.leaky_relu(functional.linear(flow, weight, bias), SLOPE, inplace=True)
        for layer in self.dense[1:]:
            flow = functional.leaky_relu(layer(flow), SLOPE, inplace=True)
        return self.logits(flow).float(), self.value(flow).float().squeeze(1)

    def _first(self, seen: torch.Tensor, sparse: Sparse | None) -> torch.Tensor:
        """The first layer's output [B, 25, H, W]."""
        if seen.device.type == "cpu":
            ready = sparse or _sparse(self.map, self.first)
            flow: torch.Tensor = _SparseConvolution.apply(
                seen, self.map, self.first.weight, self.first.bias, *ready
            )
            return flow
        seen = seen.float().contiguous(memory_format=torch.channels_last)
        return functional.leaky_relu(self.first(seen), SLOPE)

    def _turned(self) -> torch.Tensor:
        """The weights [64, h * w * 25] of the first dense layer, for convolutions that lie channels last.

        To turn what the convolutions give, and in learning its gradient, would take many times as long.
        """
        height, width = (side - _NEXT_KERNEL + 1 for side in self.map.shape[1:])
        weight, _ = self.dense[0].parameters()
        return weight.view(HIDDEN, FILTERS, height, width).permute(0, 2, 3, 1).flatten(1)

    def prepared(self) -> Prepared:
        """What `forward` makes of the weights, for many calls between which they do not change."""
        if self.map.device.type == "cpu":
            return _sparse(self.map, self.first), self._turned().detach()
        return self.products()

    def products(self) -> list[Product]:
        """The three convolutions as matrices."""
        height, width = self.map.shape[1:]
        return [product(layer, height, width) for layer in (self.first, self.second, self.third)]
