"""Trained networks as ONNX files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from galley.learning.cloning.training import Layer
from galley.learning.ppo.policy import SLOPE

OPSET = 17
IR_VERSION = 8
"""Old enough for every ONNX Runtime that Galley allows."""


def dense_onnx(layers: Sequence[Layer]) -> bytes:
    """An ONNX file of dense layers with tanh between them, the same bytes for the same weights.

    Input `observation` float32 [B, F], output `logits` float32 [B, 6], dynamic B.
    """
    nodes, constants = [], []
    value = "observation"
    for place, (weights, biases) in enumerate(layers):
        constants.append(numpy_helper.from_array(np.ascontiguousarray(weights), f"weights_{place}"))
        constants.append(numpy_helper.from_array(np.ascontiguousarray(biases), f"biases_{place}"))
        last = place == len(layers) - 1
        result = "logits" if last else f"dense_{place}"
        names = [value, f"weights_{place}", f"biases_{place}"]
        nodes.append(helper.make_node("Gemm", names, [result], name=f"gemm_{place}", transB=1))
        value = result
        if not last:
            value = f"tanh_{place}"
            nodes.append(helper.make_node("Tanh", [result], [value], name=value))
    return _file(nodes, constants, [layers[0][0].shape[1]], layers[-1][0].shape[0])


def grid_onnx(weights: Mapping[str, NDArray[np.float32]], shape: tuple[int, ...]) -> bytes:
    """An ONNX file of a `Policy` from its state dict as arrays, for observations of `shape` [C, H, W].

    Input `observation` float32 [B, C, H, W], output `logits` float32 [B, 6], dynamic B; without the value.
    """
    nodes, value = [], "observation"
    used = {name: array for name, array in weights.items() if not name.startswith("value.")}
    constants = [numpy_helper.from_array(np.ascontiguousarray(array), name) for name, array in used.items()]
    for name in (name.removesuffix(".weight") for name in used if name.endswith(".weight")):
        inputs = [value, f"{name}.weight", f"{name}.bias"]
        kernel = weights[f"{name}.weight"].shape[2:]
        if kernel:
            reach = 0 if name == "third" else kernel[0] // 2
            nodes.append(helper.make_node("Conv", inputs, [f"{name}_sum"], name=name, pads=[reach] * 4))
        else:
            if name == "dense.0":
                nodes.append(helper.make_node("Flatten", [value], ["flat"], name="flatten"))
                inputs[0] = "flat"
            result = "logits" if name == "logits" else f"{name}_sum"
            nodes.append(helper.make_node("Gemm", inputs, [result], name=name, transB=1))
        if name != "logits":
            value = f"{name}_out"
            nodes.append(
                helper.make_node("LeakyRelu", [f"{name}_sum"], [value], name=f"{name}_leaky", alpha=SLOPE)
            )
    return _file(nodes, constants, list(shape), weights["logits.bias"].shape[0])


def _file(
    nodes: list[onnx.NodeProto], constants: list[onnx.TensorProto], shape: list[int], actions: int
) -> bytes:
    """The checked bytes of a policy's graph, the same for the same graph."""
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["B", *shape])],
        [helper.make_tensor_value_info("logits", TensorProto.FLOAT, ["B", actions])],
        constants,
    )
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="galley", ir_version=IR_VERSION
    )
    onnx.checker.check_model(model)
    content: bytes = model.SerializeToString(deterministic=True)
    return content
