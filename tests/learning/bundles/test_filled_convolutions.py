"""Filled networks answer as before, and what is no such network stays as it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import pytest

from galley.agents.network import Network
from galley.kitchen import Encoder, Layout
from galley.learning.bundles.filled_convolutions import filled
from tests.agents.admission.newcomers import cole_policy
from tests.agents.policies import linear_policy, summing_policy

ROOM = Layout.from_ascii("room", "XXPXX\nO  2O\nX1  X\nXDXSX")


def test_a_filled_network_gives_the_same_logits_but_for_rounding(tmp_path: Path) -> None:
    shape = Encoder(ROOM, "grid").shape
    plain, full = tmp_path / "plain.onnx", tmp_path / "filled.onnx"
    plain.write_bytes(cole_policy(shape, seed=3))
    full.write_bytes(filled(plain.read_bytes()))
    seen = np.random.default_rng(1).integers(0, 3, (40, *shape)).astype(np.float32)
    wanted, _ = Network(plain, shape).run(seen)
    found, _ = Network(full, shape).run(seen)
    np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-5)
    assert np.abs(wanted).max() > 0.01


def test_all_channels_are_multiples_of_16() -> None:
    content = filled(cole_policy(Encoder(ROOM, "grid").shape))
    model = onnx.load_from_string(content)
    kernels = [one.dims for one in model.graph.initializer if len(one.dims) == 4]
    assert [list(dims[:2]) for dims in kernels] == [[32, 32], [32, 32], [32, 32]]
    assert filled(content) is content
    assert filled(cole_policy(Encoder(ROOM, "grid").shape)) == content


@pytest.mark.parametrize("policy", [linear_policy, summing_policy])
def test_networks_without_convolutions_stay_as_they_are(policy: object) -> None:
    content = policy()  # type: ignore[operator]
    assert filled(content) is content
