"""ONNX files of other people made into policies as Galley runs them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
import onnxruntime as ort
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper, version_converter

from galley.agents.admission.adding import Converted
from galley.agents.admission.gate import probabilities
from galley.errors import GalleyError
from galley.kitchen import ACTIONS

OLDEST_OPSET: Final = 9
"""Files of older operator sets are brought to `NEW_OPSET`; newer ones keep theirs."""
NEW_OPSET: Final = 17
NEWEST_IR: Final = 10
"""What every ONNX Runtime that Galley allows can read."""
TINY: Final = 1e-30
"""Probabilities below count as this much, since 0 has no logarithm."""
TRIED: Final = 5
_CLOSE: Final = 1e-4
_INSIDE: Final = "inner_"


@dataclass
class _Policy:
    """A model on its way; `fed` and `given` are the values that become observation and logits."""

    model: Any
    fed: str
    given: str
    notes: list[str]


def conform(file: Path | bytes, shape: tuple[int, ...]) -> Converted:
    """The same policy from `observation` [B, *shape] to `logits` [B, 6] with dynamic B, in one file.

    Names and number types are changed, a softmax at the end is taken off (or a logarithm of the probabilities
    put behind it), outputs beside the logits are dropped, a fixed batch is opened, and where that changes the
    answers, one observation is run after the other. Recurrent policies must have the names `state_in` and
    `state_out` already.

    Raises:
        GalleyError: it is no ONNX, or its inputs and outputs are not those of a policy.
    """
    policy = _opened(file)
    expected = _Expected(policy, shape)
    take_log = not _take_off_softmax(policy) and expected.probabilities
    bare = policy.model.SerializeToString()
    for way in (_as_batch, _one_by_one):
        model = onnx.load_model_from_string(bare)
        finished = way(_Policy(model, policy.fed, policy.given, []), expected, shape, take_log)
        content: bytes = finished.model.SerializeToString(deterministic=True)
        if expected.met_by(content):
            return Converted(content, (*policy.notes, *finished.notes))
    raise GalleyError("the network could not be brought to a dynamic batch size; export it again with one")


class _Expected:
    """What the policy answers as it came, to a few observations, each by itself if the batch is not free."""

    def __init__(self, policy: _Policy, shape: tuple[int, ...]) -> None:
        session = _session(policy.model.SerializeToString())
        fed = next(one for one in session.get_inputs() if one.name == policy.fed)
        told = f"input '{fed.name.removeprefix(_INSIDE)}' has shape {list(fed.shape)}, not {['B', *shape]}"
        self.batchless = len(fed.shape) == len(shape)
        sizes = list(fed.shape) if self.batchless else list(fed.shape[1:])
        if len(sizes) != len(shape) or any(
            isinstance(size, int) and size != want for size, want in zip(sizes, shape, strict=True)
        ):
            raise GalleyError(told)
        self.batch = fed.shape[0] if not self.batchless and isinstance(fed.shape[0], int) else None
        if self.batch not in (None, 1):
            raise GalleyError(f"{told}; a fixed batch can be opened if it is 1")
        kind = _NUMPY.get(fed.type)
        if kind is None:
            raise GalleyError(f"input '{fed.name.removeprefix(_INSIDE)}' is {fed.type}, not tensor(float)")
        self.kind = kind
        self.seen = np.random.default_rng(0).integers(0, 3, (TRIED, *shape)).astype(np.float32)
        rows = []
        for one in self.seen if self.batchless else self.seen[:, None]:
            try:
                found = np.asarray(session.run([policy.given], {policy.fed: one.astype(kind)})[0])
            except Exception as error:  # ONNX Runtime has no common base for what it raises
                raise GalleyError(f"the network cannot be run ({_first_line(error)})") from None
            if found.size != len(ACTIONS):
                shown = policy.given.removeprefix(_INSIDE)
                raise GalleyError(
                    f"output '{shown}' has {found.size} numbers for one observation (shape "
                    f"{list(found.shape)}), not {len(ACTIONS)}"
                )
            rows.append(found.reshape(-1).astype(np.float32))
        self.given: NDArray[np.float32] = np.stack(rows)
        self.flat = found.ndim != 2
        self.probabilities = probabilities(self.given)

    def met_by(self, content: bytes) -> bool:
        """Whether the finished file answers batches of any size like this, up to a constant in each row."""
        try:
            session = _session(content)
            if session.get_outputs()[0].shape[1:] != [len(ACTIONS)]:
                return False
            for size in (1, 2, TRIED):
                found = session.run(["logits"], {"observation": self.seen[:size]})[0]
                if found.shape != (size, len(ACTIONS)):
                    return False
                if not np.allclose(_shares(found), self._shares[:size], atol=_CLOSE, equal_nan=True):
                    return False
        except Exception:  # as above: what cannot be run is no answer
            return False
        return True

    @property
    def _shares(self) -> NDArray[np.float32]:
        return self.given if self.probabilities else _shares(self.given)


def _opened(file: Path | bytes) -> _Policy:
    """The model of a file with its observation and logits found, and all its other values renamed."""
    try:
        model = onnx.load(file) if isinstance(file, Path) else onnx.load_model_from_string(file)
    except Exception as error:  # protobuf's and file errors, and those of data kept beside the model
        raise GalleyError(f"the file is not ONNX that can be read ({_first_line(error)})") from None
    notes = []
    opset = next((one.version for one in model.opset_import if one.domain in ("", "ai.onnx")), 0)
    if opset < OLDEST_OPSET:
        try:
            model = version_converter.convert_version(model, NEW_OPSET)
        except Exception as error:  # the converter raises RuntimeError and its own kinds
            told = f"operator set {opset} is too old and cannot be brought to {NEW_OPSET}"
            raise GalleyError(f"{told} ({_first_line(error)})") from None
        notes.append(f"operator set {opset} brought to {NEW_OPSET}")
    model.ir_version = min(model.ir_version, NEWEST_IR)
    constants = {one.name for one in model.graph.initializer}
    inputs = [one for one in model.graph.input if one.name not in constants]
    outputs = list(model.graph.output)
    del model.graph.input[:], model.graph.value_info[:]
    model.graph.input.extend(inputs)
    if len(inputs) != 1:
        raise GalleyError(
            f"the inputs are {sorted(one.name for one in inputs)}; a policy has one, the observation (one "
            "with memory also state_in and state_out, named so)"
        )
    given = _logits_among(outputs)
    others = [one.name for one in outputs if one.name != given.name]
    if others:
        notes.append(f"outputs dropped: {', '.join(others)}")
    for old, new in ((inputs[0].name, "observation"), (given.name, "logits")):
        if old != new:
            notes.append(f"'{old}' renamed to '{new}'")
    del model.graph.output[:]
    model.graph.output.append(given)
    fed_name, given_name = inputs[0].name, given.name
    model = onnx.compose.add_prefix(model, _INSIDE)
    return _Policy(model, _INSIDE + fed_name, _INSIDE + given_name, notes)


def _logits_among(outputs: list[Any]) -> Any:
    """The output that holds the logits: named so, the only one, or the only one that ends in six."""
    named = [one for one in outputs if one.name == "logits"]
    ends = [one for one in outputs if _last_size(one) == len(ACTIONS)]
    for found in (named, outputs, ends):
        if len(found) == 1:
            return found[0]
    shown = {one.name: [_size(dim) for dim in one.type.tensor_type.shape.dim] for one in outputs}
    raise GalleyError(f"which output holds the logits is not clear: {shown}; name it 'logits'")


def _last_size(output: Any) -> object:
    sizes = [_size(dim) for dim in output.type.tensor_type.shape.dim]
    return sizes[-1] if sizes else None


def _size(dim: Any) -> int | str:
    return int(dim.dim_value) if dim.HasField("dim_value") else str(dim.dim_param or "?")


def _take_off_softmax(policy: _Policy) -> bool:
    """Whether a softmax ended the network; the output is now what goes into it."""
    makers = {name: node for node in policy.model.graph.node for name in node.output}
    name = policy.given
    while name in makers and makers[name].op_type == "Identity":
        name = makers[name].input[0]
    if name not in makers or makers[name].op_type != "Softmax":
        return False
    policy.given = makers[name].input[0]
    del policy.model.graph.output[:]
    policy.model.graph.output.append(onnx.ValueInfoProto(name=policy.given))
    policy.model.graph.output[0].type.tensor_type.elem_type = TensorProto.FLOAT
    policy.notes.append("the softmax at the end taken off")
    return True


def _as_batch(policy: _Policy, expected: _Expected, shape: tuple[int, ...], take_log: bool) -> _Policy:
    """The policy with its batch size free, which is right if no other number in it hangs on that."""
    graph = policy.model.graph
    if expected.batch is not None:
        _free_reshapes(graph)
        policy.notes.append("the fixed batch of 1 opened")
    before = [helper.make_node("Cast", ["observation"], [policy.fed], to=_ONNX[expected.kind])]
    after, name = _ending(policy, expected.flat, take_log)
    return _closed(policy, [*before, *graph.node, *after], name, shape)


def _one_by_one(policy: _Policy, expected: _Expected, shape: tuple[int, ...], take_log: bool) -> _Policy:
    """The policy inside a loop over the batch."""
    graph = policy.model.graph
    one_shape = list(shape) if expected.batchless else [1, *shape]
    graph.initializer.append(numpy_helper.from_array(np.array(one_shape, dtype=np.int64), "one_shape"))
    graph.initializer.append(numpy_helper.from_array(np.array([len(ACTIONS)], dtype=np.int64), "row_shape"))
    nodes = [
        helper.make_node("Reshape", ["one", "one_shape"], ["one_shaped"]),
        helper.make_node("Cast", ["one_shaped"], [policy.fed], to=_ONNX[expected.kind]),
        *graph.node,
        helper.make_node("Cast", [policy.given], ["one_given"], to=TensorProto.FLOAT),
        helper.make_node("Reshape", ["one_given", "row_shape"], ["row"]),
    ]
    body = helper.make_graph(
        nodes,
        "one_observation",
        [helper.make_tensor_value_info("one", TensorProto.FLOAT, list(shape))],
        [helper.make_tensor_value_info("row", TensorProto.FLOAT, [len(ACTIONS)])],
    )
    loop = helper.make_node("Scan", ["observation"], ["rows"], body=body, num_scan_inputs=1)
    policy.given = "rows"
    after, name = _ending(policy, False, take_log)
    policy.notes.append("no batch size but 1 fits inside it, so observations are run one after the other")
    return _closed(policy, [loop, *after], name, shape)


def _ending(policy: _Policy, flat: bool, take_log: bool) -> tuple[list[Any], str]:
    """Nodes that make float32 [B, 6] logits of what the network gives, and the name of their result."""
    nodes = [helper.make_node("Cast", [policy.given], ["given_float"], to=TensorProto.FLOAT)]
    name = "given_float"
    constants = policy.model.graph.initializer
    if flat:
        rows = np.array([-1, len(ACTIONS)], dtype=np.int64)
        constants.append(numpy_helper.from_array(rows, "rows_shape"))
        nodes.append(helper.make_node("Reshape", [name, "rows_shape"], ["given_rows"]))
        name = "given_rows"
    if take_log:
        constants.append(numpy_helper.from_array(np.array(TINY, dtype=np.float32), "tiny"))
        nodes += [
            helper.make_node("Max", [name, "tiny"], ["above_zero"]),
            helper.make_node("Log", ["above_zero"], ["logarithms"]),
        ]
        name = "logarithms"
        policy.notes.append("the logarithm of the probabilities taken")
    return nodes, name


def _closed(policy: _Policy, nodes: list[Any], name: str, shape: tuple[int, ...]) -> _Policy:
    """The policy with these nodes between `observation` and `logits`."""
    graph = policy.model.graph
    last = helper.make_node("Identity", [name], ["logits"])
    all_nodes = [onnx.NodeProto.FromString(node.SerializeToString()) for node in [*nodes, last]]
    del graph.node[:], graph.input[:], graph.output[:]
    graph.node.extend(all_nodes)
    graph.input.append(helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["B", *shape]))
    graph.output.append(helper.make_tensor_value_info("logits", TensorProto.FLOAT, ["B", len(ACTIONS)]))
    return policy


def _free_reshapes(graph: Any) -> None:
    """Let every reshape to [1, ...] keep the size of the batch instead."""
    targets = {node.input[1] for node in graph.node if node.op_type == "Reshape"}
    for tensor in _constants(graph):
        if tensor[0] in targets:
            numbers = numpy_helper.to_array(tensor[1]).copy()
            if numbers.ndim == 1 and len(numbers) > 1 and numbers[0] == 1:
                numbers[0] = 0
                tensor[1].CopyFrom(numpy_helper.from_array(numbers, tensor[1].name))


def _constants(graph: Any) -> Iterator[tuple[str, Any]]:
    for tensor in graph.initializer:
        yield tensor.name, tensor
    for node in graph.node:
        if node.op_type == "Constant":
            for attribute in node.attribute:
                if attribute.name == "value":
                    yield node.output[0], attribute.t


def _session(content: bytes) -> Any:
    options = ort.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 4
    try:
        return ort.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # as above
        raise GalleyError(f"the file is not ONNX that can be run ({_first_line(error)})") from None


def _shares(logits: NDArray[np.float32]) -> NDArray[np.float32]:
    """The probabilities that logits [B, 6] stand for."""
    weights: NDArray[np.float32] = np.exp(logits - logits.max(axis=1, keepdims=True))
    shares: NDArray[np.float32] = weights / weights.sum(axis=1, keepdims=True)
    return shares


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]


_NUMPY: Final[dict[str, type[np.generic]]] = {
    "tensor(float)": np.float32,
    "tensor(double)": np.float64,
    "tensor(float16)": np.float16,
    "tensor(uint8)": np.uint8,
    "tensor(int32)": np.int32,
    "tensor(int64)": np.int64,
}
_ONNX: Final[dict[type[np.generic], int]] = {
    np.float32: TensorProto.FLOAT,
    np.float64: TensorProto.DOUBLE,
    np.float16: TensorProto.FLOAT16,
    np.uint8: TensorProto.UINT8,
    np.int32: TensorProto.INT32,
    np.int64: TensorProto.INT64,
}
