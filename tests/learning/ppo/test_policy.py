"""The policy network: the sparse first convolution is the dense one, and ONNX is the network."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnxruntime as ort
import pytest
import torch
from torch.nn import functional

from galley.kitchen import Encoder, KitchenBatch, Layout
from galley.kitchen.layout_file import load_layout
from galley.learning.bundles.onnx_writing import grid_onnx
from galley.learning.ppo.policy import SLOPE, Policy
from tests.learning.kitchens import SMALL

ROOT = Path(__file__).resolve().parents[3]
LAYOUTS = [SMALL, *(load_layout(path) for path in sorted((ROOT / "layouts").glob("c*.yaml")))]


def observations(layout: Layout, size: int = 37, ticks: int = 60) -> torch.Tensor:
    """Random play, late in the episode so that the urgent channel is on in some."""
    layout = layout.with_rules(horizon_ticks=100)
    batch = KitchenBatch(layout, size)
    rng = np.random.default_rng(0)
    for _ in range(ticks):
        batch.step(rng.integers(0, 6, (size, 2)))
    batch.states[::3, 6] = 70
    return torch.from_numpy(Encoder(layout, "grid").seat(batch.states, 1))


def dense(policy: Policy, seen: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """The network as PyTorch's own layers make it."""
    flow = seen.float()
    for layer in (policy.first, policy.second, policy.third):
        flow = functional.leaky_relu(layer(flow), SLOPE)
    flow = flow.flatten(1)
    for layer in policy.dense:
        flow = functional.leaky_relu(layer(flow), SLOPE)
    return policy.logits(flow), policy.value(flow).squeeze(1)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_sparse_and_dense_agree_in_results_and_gradients(layout: Layout) -> None:
    policy = Policy(layout, torch.Generator().manual_seed(1))
    seen = observations(layout)
    assert torch.unique(seen[:, 25]).tolist() == [0, 1]
    gradients = []
    for found in (policy(seen), dense(policy, seen)):
        policy.zero_grad()
        (found[0].square().sum() + found[1].square().sum()).backward()
        gradients.append([parameter.grad.clone() for parameter in policy.parameters()])
    logits, values = policy(seen)
    torch.testing.assert_close(logits, dense(policy, seen)[0], rtol=1e-4, atol=1e-6)
    torch.testing.assert_close(values, dense(policy, seen)[1], rtol=1e-4, atol=1e-5)
    for sparse, other in zip(*gradients, strict=True):
        torch.testing.assert_close(sparse, other, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_convolutions_are_products_with_a_matrix(layout: Layout) -> None:
    policy = Policy(layout, torch.Generator().manual_seed(1))
    for layer in (policy.first, policy.second, policy.third):
        torch.nn.init.normal_(layer.bias)
    seen = observations(layout)
    gradients = []
    for found in (policy(seen, policy.products()), dense(policy, seen)):
        policy.zero_grad()
        (found[0].square().sum() + found[1].square().sum()).backward()
        gradients.append([parameter.grad.clone() for parameter in policy.parameters()])
    torch.testing.assert_close(policy(seen, policy.products()), dense(policy, seen), rtol=1e-4, atol=1e-5)
    for one, other in zip(*gradients, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-3, atol=1e-4)


def test_the_sparse_convolution_reads_any_difference_from_the_map() -> None:
    policy = Policy(SMALL, torch.Generator().manual_seed(1))
    seen = torch.randint(0, 4, (5, *policy.map.shape), dtype=torch.uint8)
    torch.testing.assert_close(policy(seen)[0], dense(policy, seen)[0], rtol=1e-4, atol=1e-5)


def test_the_encoders_map_is_what_every_observation_shares() -> None:
    for name in ("grid", "overcooked-2019-grid"):
        encoder = Encoder(SMALL, name)
        batch = KitchenBatch(SMALL, 50)
        rng = np.random.default_rng(1)
        for _ in range(10):
            batch.step(rng.integers(0, 6, (50, 2)))
        seen = encoder.seat(batch.states, 0)
        assert encoder.map.any()
        assert (seen[:, encoder.map > 0] == encoder.map[encoder.map > 0]).all()


def test_onnx_gives_the_logits_of_the_network() -> None:
    policy = Policy(SMALL, torch.Generator().manual_seed(2))
    seen = observations(SMALL)
    content = grid_onnx(
        {name: tensor.numpy() for name, tensor in policy.state_dict().items()}, tuple(seen.shape[1:])
    )
    session = ort.InferenceSession(content, providers=["CPUExecutionProvider"])
    logits = session.run(["logits"], {"observation": seen.float().numpy()})[0]
    np.testing.assert_allclose(logits, policy(seen)[0].detach().numpy(), rtol=1e-4, atol=1e-6)


def test_equal_seeds_make_equal_weights_and_others_do_not() -> None:
    one, same, other = (Policy(SMALL, torch.Generator().manual_seed(seed)) for seed in (3, 3, 4))
    assert torch.equal(one.second.weight, same.second.weight)
    assert not torch.equal(one.second.weight, other.second.weight)
