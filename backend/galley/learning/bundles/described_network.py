"""Networks described in a file, with weights from elsewhere, as ONNX."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
import onnx
import pydantic
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from galley.errors import GalleyError
from galley.files.reading import FileModel, load
from galley.kitchen import ACTIONS
from galley.learning.bundles.onnx_writing import IR_VERSION, OPSET
from galley.names import name_fix

Tensors = Mapping[str, NDArray[np.float32]]
Activation = Literal["none", "relu", "leaky_relu", "tanh", "elu", "sigmoid"]

_OPERATORS: Final[Mapping[str, str]] = {
    "relu": "Relu",
    "leaky_relu": "LeakyRelu",
    "tanh": "Tanh",
    "elu": "Elu",
    "sigmoid": "Sigmoid",
}


class _Weighted(FileModel):
    """What every layer has. `weights` is the name of its weights in the state dict up to `.weight`."""

    activation: Activation = "none"
    slope: Annotated[float, pydantic.Field(gt=0, le=10)] = 0.01
    weights: str | None = None


class Conv(_Weighted):
    """A convolution with a square kernel; `padding` is `same`, `valid` or a number of cells."""

    kind: Literal["conv"]
    filters: Annotated[int, pydantic.Field(ge=1)]
    kernel: Annotated[int, pydantic.Field(ge=1)]
    stride: Annotated[int, pydantic.Field(ge=1)] = 1
    padding: Literal["same", "valid"] | Annotated[int, pydantic.Field(ge=0)] = "valid"


class Dense(_Weighted):
    """A dense layer; behind a convolution it takes channels, rows and columns in this order."""

    kind: Literal["dense"]
    width: Annotated[int, pydantic.Field(ge=1)]


class NetworkFile(FileModel):
    """A network as a list of layers; `channels: last` brings the last axis of the observation to the front.

    Tensors of the state dict whose names begin with one of `ignore` belong to no layer.
    """

    format: Literal[1]
    layers: tuple[Annotated[Conv | Dense, pydantic.Field(discriminator="kind")], ...]
    channels: Literal["first", "last"] = "first"
    ignore: tuple[str, ...] = ()


def _layers(*rows: dict[str, Any]) -> NetworkFile:
    return NetworkFile.model_validate({"format": 1, "layers": rows})


_HIDDEN: Final = {"kind": "dense", "width": 64}
_LEAKY: Final = {"activation": "leaky_relu", "slope": 0.2}
_CONV: Final = {"kind": "conv", "filters": 25, **_LEAKY}

KNOWN: Final[Mapping[str, NetworkFile]] = {
    "cole-cnn": _layers(
        {**_CONV, "kernel": 5, "padding": "same"},
        {**_CONV, "kernel": 3, "padding": "same"},
        {**_CONV, "kernel": 3, "padding": "valid"},
        *({**_HIDDEN, **_LEAKY} for _ in range(3)),
        {"kind": "dense", "width": 6},
    ),
    "bc-mlp": _layers(*({**_HIDDEN, "activation": "tanh"} for _ in range(2)), {"kind": "dense", "width": 6}),
}
"""Networks that have a name. Source: `cole-cnn` Li et al. 2023 (COLE), appendix on the oracle, and the
published code of Carroll et al. 2019 for kernels and slope; `bc-mlp` the clones of Carroll et al. 2019."""


def network_named(name: str) -> NetworkFile:
    """The network of a known name, or the one described in the YAML or JSON file of this name.

    Raises:
        GalleyError: there is neither.
        InvalidFiles: everything that is wrong with the file.
    """
    if name in KNOWN:
        return KNOWN[name]
    path = Path(name)
    if path.is_file():
        return load(path, NetworkFile, path.as_posix()).value
    raise GalleyError(
        f"--network: '{name}' is neither a known network ({' '.join(KNOWN)}), nor a file that describes one, "
        f"nor module:Class; {name_fix(name, KNOWN)}"
    )


def described_onnx(network: NetworkFile, tensors: Tensors, shape: tuple[int, ...]) -> bytes:
    """The network with these weights as ONNX: `observation` [B, *shape] to `logits` [B, 6].

    Layers without `weights` take the tensors in their order in the state dict.

    Raises:
        GalleyError: everything in which weights and description do not fit each other.
    """
    pairs = _pairs(network, tensors)
    graph = _Graph()
    value, now = "observation", list(shape)
    told: list[str] = []
    options: dict[str, Any]
    if network.channels == "last":
        axes = [len(shape) - 1, *range(len(shape) - 1)]
        value = graph.add("Transpose", [value], perm=[0, *(axis + 1 for axis in axes)])
        now = [now[axis] for axis in axes]
    for (prefix, weight, bias), layer in zip(pairs, network.layers, strict=True):
        if isinstance(layer, Conv):
            if len(now) != 3:
                raise GalleyError(f"layer {prefix}: a convolution needs [C, H, W], not {now}")
            wanted: list[int] = [layer.filters, now[0], layer.kernel, layer.kernel]
            pad = _padding(layer)
            now = [
                layer.filters,
                *((size + 2 * pad - layer.kernel) // layer.stride + 1 for size in now[1:]),
            ]
            options = {"pads": [pad] * 4, "strides": [layer.stride] * 2, "kernel_shape": [layer.kernel] * 2}
            operator = "Conv"
        else:
            if len(now) > 1:
                value, now = graph.add("Flatten", [value], axis=1), [int(np.prod(now))]
            wanted, now = [layer.width, now[0]], [layer.width]
            options, operator = {"transB": 1}, "Gemm"
        if min(now) < 1:
            raise GalleyError(f"layer {prefix}: nothing is left of the observation, {now}")
        if list(weight.shape) != wanted:
            told.append(f"'{prefix}.weight' has shape {list(weight.shape)}, not {wanted}")
        if bias is not None and list(bias.shape) != wanted[:1]:
            told.append(f"'{prefix}.bias' has shape {list(bias.shape)}, not {wanted[:1]}")
        filled = np.zeros(wanted[0], dtype=np.float32) if bias is None else bias
        value = graph.add(operator, [value, graph.constant(weight), graph.constant(filled)], **options)
        if layer.activation != "none":
            alpha = {"alpha": layer.slope} if layer.activation == "leaky_relu" else {}
            value = graph.add(_OPERATORS[layer.activation], [value], **alpha)
    if now != [len(ACTIONS)]:
        told.append(f"the last layer gives {now}, not [{len(ACTIONS)}]")
    if told:
        raise GalleyError("; ".join(told))
    return graph.finished(value, shape)


def _padding(layer: Conv) -> int:
    if isinstance(layer.padding, int):
        return layer.padding
    if layer.padding == "valid":
        return 0
    if layer.kernel % 2 == 0 or layer.stride != 1:
        raise GalleyError("padding same needs an odd kernel and stride 1; give the number of cells")
    return layer.kernel // 2


def _pairs(
    network: NetworkFile, tensors: Tensors
) -> list[tuple[str, NDArray[np.float32], NDArray[np.float32] | None]]:
    """Name, weights and biases of each layer."""
    used = [name for name in tensors if not name.startswith(network.ignore or ("\0",))]
    prefixes = [name.removesuffix(".weight") for name in used if name.endswith(".weight")]
    named = {layer.weights for layer in network.layers if layer.weights is not None}
    told = [f"the state dict has no '{name}.weight'" for name in sorted(named - set(prefixes))]
    free = iter([prefix for prefix in prefixes if prefix not in named])
    taken = [layer.weights if layer.weights is not None else next(free, None) for layer in network.layers]
    if None in taken:
        told.append(
            f"the network has {len(network.layers)} layers, the state dict weights for {len(prefixes)} "
            f"({', '.join(prefixes)})"
        )
    whole = {f"{prefix}.{part}" for prefix in taken for part in ("weight", "bias")}
    left = [name for name in used if name not in whole]
    if left:
        told.append(f"no layer takes {', '.join(left)}; describe them, or list them under `ignore`")
    if told:
        raise GalleyError("; ".join(told))
    return [(str(name), tensors[f"{name}.weight"], tensors.get(f"{name}.bias")) for name in taken]


class _Graph:
    """Nodes and constants of a model in the making, numbered as they come."""

    def __init__(self) -> None:
        self._nodes: list[Any] = []
        self._constants: list[Any] = []

    def add(self, operator: str, inputs: list[str], **options: Any) -> str:
        """The name of what one more operator gives."""
        result = f"{operator.lower()}_{len(self._nodes)}"
        self._nodes.append(helper.make_node(operator, inputs, [result], name=result, **options))
        return result

    def constant(self, numbers: NDArray[np.float32]) -> str:
        """The name of one more constant."""
        name = f"weights_{len(self._constants)}"
        self._constants.append(numpy_helper.from_array(np.ascontiguousarray(numbers, np.float32), name))
        return name

    def finished(self, value: str, shape: tuple[int, ...]) -> bytes:
        """The ONNX file."""
        nodes = [*self._nodes, helper.make_node("Identity", [value], ["logits"], name="logits")]
        graph = helper.make_graph(
            nodes,
            "policy",
            [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["B", *shape])],
            [helper.make_tensor_value_info("logits", TensorProto.FLOAT, ["B", len(ACTIONS)])],
            self._constants,
        )
        model = helper.make_model(
            graph,
            opset_imports=[helper.make_opsetid("", OPSET)],
            producer_name="galley",
            ir_version=IR_VERSION,
        )
        onnx.checker.check_model(model)
        content: bytes = model.SerializeToString(deterministic=True)
        return content
