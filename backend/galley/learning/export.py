"""Trained networks as ONNX files."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from galley.learning.cloning import Layer

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
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["B", layers[0][0].shape[1]])],
        [helper.make_tensor_value_info("logits", TensorProto.FLOAT, ["B", layers[-1][0].shape[0]])],
        constants,
    )
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="galley", ir_version=IR_VERSION
    )
    onnx.checker.check_model(model)
    content: bytes = model.SerializeToString(deterministic=True)
    return content
