"""Small ONNX policies and bundles made for tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from galley.agents.bundle import Bundle, load_bundle
from galley.kitchen import Layout

ROOM = Layout.from_ascii("room", "XXPXX\nO  2O\nX1  X\nXDXSX")
FEATURES = "overcooked-2019-features"


def linear_policy(
    features: int = 62,
    outputs: int = 6,
    seed: int = 0,
    *,
    bias: list[float] | None = None,
    scale: float = 0.2,
) -> bytes:
    """One dense layer with random weights, from `observation` [B, features] to `logits` [B, outputs]."""
    weights = np.random.default_rng(seed).normal(size=(features, outputs)).astype(np.float32) * scale
    added = np.array(bias or [0.0] * outputs, dtype=np.float32)
    return model(
        [helper.make_node("Gemm", ["observation", "w", "b"], ["logits"])],
        {"observation": ["B", features]},
        {"logits": ["B", outputs]},
        {"w": weights, "b": added},
    )


def summing_policy() -> bytes:
    """A recurrent policy whose state sums what it saw and whose logits are a random map of that sum."""
    weights = np.random.default_rng(1).normal(size=(62, 6)).astype(np.float32) * 0.1
    nodes = [
        helper.make_node("Add", ["observation", "state_in"], ["state_out"]),
        helper.make_node("MatMul", ["state_out", "w"], ["logits"]),
    ]
    return model(
        nodes,
        {"observation": ["B", 62], "state_in": ["B", 62]},
        {"logits": ["B", 6], "state_out": ["B", 62]},
        {"w": weights},
    )


def model(
    nodes: list[onnx.NodeProto],
    inputs: dict[str, list[str | int]],
    outputs: dict[str, list[str | int]],
    constants: dict[str, np.ndarray],
) -> bytes:
    """An ONNX file of these parts, all float32."""
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in inputs.items()],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in outputs.items()],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    return bytes(made.SerializeToString())


def write_bundle(
    folder: Path, policy: bytes, *, name: str = "chef", sampling: str = "sample", unstuck: str = "3"
) -> Path:
    """The folder of a network bundle for the layout `room`."""
    place = folder / name
    place.mkdir(parents=True)
    (place / "room.onnx").write_bytes(policy)
    (place / "agent.yaml").write_text(
        f"format: 1\nname: {name}\nkind: network\nencoding: {FEATURES}\nsampling: {sampling}\n"
        f"unstuck_after_ticks: {unstuck}\nlayouts:\n  room: room.onnx\n",
        encoding="utf-8",
    )
    return place


def bundle(folder: Path, policy: bytes, **changes: str) -> Bundle:
    """A network bundle for the layout `room`, loaded."""
    place = write_bundle(folder, policy, **changes)
    return load_bundle(place, f"agents/{place.name}")
