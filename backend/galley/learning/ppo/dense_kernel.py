"""Convolutions as matrix products, for playing on GPUs: for the few rows of a tick one product is quicker."""

from __future__ import annotations

from functools import lru_cache

import torch
from torch import nn
from torch.nn import functional

Product = tuple[torch.Tensor, torch.Tensor]
"""Weight [out * cells', in * cells] and bias [out * cells'] of the linear layer that a convolution is."""


def product(layer: nn.Conv2d, height: int, width: int) -> Product:
    """The linear layer that does what a square convolution with a bias does to images of H x W cells."""
    count, channels, size, _ = layer.weight.shape
    taps = _taps(size, int(layer.padding[0]), height, width, layer.weight.device)
    whole = layer.weight.reshape(count * channels, -1) @ taps.flatten(1)
    cells, reached = taps.shape[1:]
    whole = whole.view(count, channels, cells, reached).permute(0, 3, 1, 2).flatten(2).flatten(0, 1)
    bias = whole.new_zeros(count) if layer.bias is None else layer.bias
    return whole, bias.repeat_interleave(reached)


@lru_cache
@torch.inference_mode(mode=False)
def _taps(size: int, padding: int, height: int, width: int, device: torch.device) -> torch.Tensor:
    """float32 [size^2, H * W, H' * W']: 1 where a place of the filter joins two cells, 0 elsewhere."""
    cells = torch.eye(height * width, device=device).view(-1, 1, height, width)
    places = torch.eye(size * size, device=device).view(-1, 1, size, size)
    return functional.conv2d(cells, places, padding=padding).flatten(2).transpose(0, 1).contiguous()
