"""Networks whose convolutions ONNX Runtime computes faster, with the same answers."""

from __future__ import annotations

from typing import Final

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import helper, numpy_helper

BLOCK: Final = 16
"""ONNX Runtime computes convolutions directly where channels fill registers of 8 or 16 numbers; where they do
not, it unfolds them into many small products of matrices. Measured: `benchmarks/crossplay.py`."""

_KEEP_ZERO: Final = ("Relu", "LeakyRelu", "Tanh")
"""What may stand behind a convolution, since channels of zeros stay zeros there."""


def filled(content: bytes) -> bytes:
    """The policy of an ONNX file with its channels filled up to multiples of 16 by zeros.

    Filters that are added have weights of 0, and so have those that would read what they give, so logits
    differ by rounding alone. A network is left as it is unless it is a chain of convolutions and activations,
    a flattening, and dense layers.
    """
    model = onnx.load_from_string(content)
    graph = model.graph
    weights = {one.name: one for one in graph.initializer}
    convolutions = [node for node in graph.node if node.op_type == "Conv"]
    dense = _dense_behind(graph, convolutions)
    if dense is None:
        return content
    arrays = {name: numpy_helper.to_array(one) for name, one in weights.items()}
    channels = arrays[convolutions[0].input[1]].shape[1]
    given, spare = convolutions[0].input[0], _up(channels) - channels
    changed: dict[str, NDArray[np.float32]] = {}
    for node in convolutions:
        kernel, bias = (arrays[name] for name in node.input[1:3])
        more = (_up(len(kernel)) - len(kernel), _up(kernel.shape[1]) - kernel.shape[1])
        changed[node.input[1]] = np.pad(kernel, ((0, more[0]), (0, more[1]), (0, 0), (0, 0)))
        changed[node.input[2]] = np.pad(bias, (0, more[0]))
    filters = len(arrays[convolutions[-1].input[2]])
    rows = arrays[dense.input[1]]
    cells = rows.shape[1] // filters
    changed[dense.input[1]] = np.pad(rows, ((0, 0), (0, cells * (_up(filters) - filters))))
    for name, array in changed.items():
        weights[name].CopyFrom(numpy_helper.from_array(np.ascontiguousarray(array), name))
    if spare:
        pads = np.array([0, 0, 0, 0, 0, spare, 0, 0], dtype=np.int64)
        graph.initializer.append(numpy_helper.from_array(pads, "fill"))
        graph.node.insert(0, helper.make_node("Pad", [given, "fill"], ["filled"], name="fill"))
        convolutions[0].input[0] = "filled"
    del graph.value_info[:]
    onnx.checker.check_model(model)
    return bytes(model.SerializeToString(deterministic=True))


def _up(channels: int) -> int:
    return -(-channels // BLOCK) * BLOCK


def _dense_behind(graph: onnx.GraphProto, convolutions: list[onnx.NodeProto]) -> onnx.NodeProto | None:
    """The dense layer that reads the convolutions' flattened output, if the network is such a chain."""
    if not convolutions:
        return None
    given = {one.name for one in graph.initializer}
    value = convolutions[0].input[0]
    if value != graph.input[0].name:
        return None
    for node in graph.node:
        if node.input[0] != value or not set(node.input[1:]) <= given or len(node.output) != 1:
            return None
        if node.op_type == "Gemm":
            rows_first = any(one.name == "transB" and one.i == 1 for one in node.attribute)
            return node if rows_first else None
        plain = node.op_type != "Conv" or len(node.input) == 3
        if node.op_type not in ("Conv", "Flatten", *_KEEP_ZERO) or not plain:
            return None
        if any(one.name == "group" and one.i != 1 for one in node.attribute):
            return None
        value = node.output[0]
    return None
