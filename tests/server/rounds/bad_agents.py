"""Networks that do what no agent should: never return, take two seconds, fail, want all memory."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import onnx
import onnxruntime as ort
from onnx import TensorProto, helper, numpy_helper

from galley.agents.bundle import describe_network
from galley.kitchen import Encoder
from galley.kitchen.layout_file import load_layout

LAYOUT = "cramped_room"
GOOD_UNTIL_TICKS_LEFT = 40
"""Until then they do no harm: what tries agents before a study begins sees nothing of it."""
FOR_EVER = 2**62
TRIED = 200_000
MOST_BYTES = 12e9


def write_bad_agents(agents: Path, layouts: Path) -> tuple[str, ...]:
    """Agents `never`, `slow`, `fails` and `hungry` in a workspace's folder; their names."""
    shape = tuple(Encoder(load_layout(layouts / f"{LAYOUT}.yaml"), "grid").shape)
    harms: Mapping[str, Sequence[onnx.NodeProto]] = {
        "never": _loop(FOR_EVER),
        "slow": _loop(round(2.0 * TRIED / _loop_s(shape))),
        "fails": _wanting(6.0, "Reshape"),
        "hungry": _wanting(MOST_BYTES / 4, "Expand"),
    }
    for name, harm in harms.items():
        folder = agents / name
        folder.mkdir()
        (folder / f"{LAYOUT}.onnx").write_bytes(_policy(shape, harm))
        describe_network(folder, [LAYOUT], encoding="grid", sampling="argmax", unstuck_after_ticks=None)
    return tuple(harms)


def _policy(shape: tuple[int, ...], harm: Sequence[onnx.NodeProto]) -> bytes:
    """A policy that stays, and makes `harmed` of `late` (1 once the time is nearly over, else 0) before."""
    nodes = [
        helper.make_node("Gather", ["observation", "last"], ["lateness"], axis=1),
        helper.make_node("ReduceMax", ["lateness"], ["late"], keepdims=0),
        *harm,
        helper.make_node("ReduceMax", ["harmed"], ["most"], keepdims=0),
        helper.make_node("Mul", ["most", "zero"], ["nothing"]),
        helper.make_node("Flatten", ["observation"], ["flat"]),
        helper.make_node("MatMul", ["flat", "w"], ["same"]),
        helper.make_node("Add", ["same", "nothing"], ["logits"]),
    ]
    constants = {
        "last": np.array(shape[0] - 1),
        "zero": np.array(0.0, dtype=np.float32),
        "w": np.zeros((int(np.prod(shape)), 6), dtype=np.float32),
    }
    observation = helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["B", *shape])
    logits = helper.make_tensor_value_info("logits", TensorProto.FLOAT, ["B", 6])
    kept = [numpy_helper.from_array(value, name) for name, value in constants.items()]
    graph = helper.make_graph(nodes, "policy", [observation], [logits], kept)
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    return bytes(made.SerializeToString())


def _constant(name: str, value: np.ndarray) -> onnx.NodeProto:
    return helper.make_node("Constant", [], [name], value=numpy_helper.from_array(value, name))


def _loop(times: int) -> list[onnx.NodeProto]:
    """Add to `late` so many times, if it is not 0."""
    of = helper.make_tensor_value_info
    body = helper.make_graph(
        [
            helper.make_node("Identity", ["on"], ["still_on"]),
            helper.make_node("Add", ["sum", "sum"], ["more"]),
        ],
        "body",
        [of("n", TensorProto.INT64, []), of("on", TensorProto.BOOL, []), of("sum", TensorProto.FLOAT, [])],
        [of("still_on", TensorProto.BOOL, []), of("more", TensorProto.FLOAT, [])],
    )
    return [
        _constant("times", np.array(times)),
        helper.make_node("Cast", ["late"], ["begun"], to=TensorProto.BOOL),
        _constant("nought", np.array(0.0, dtype=np.float32)),
        helper.make_node("Loop", ["times", "begun", "nought"], ["harmed"], body=body),
    ]


def _wanting(much: float, operator: str) -> list[onnx.NodeProto]:
    """Give `late` the shape [1], or once it is not 0 a shape of so many more."""
    return [
        _constant("much", np.array([much], dtype=np.float32)),
        _constant("one", np.array([1])),
        helper.make_node("Mul", ["much", "late"], ["wanted"]),
        helper.make_node("Cast", ["wanted"], ["counted"], to=TensorProto.INT64),
        helper.make_node("Add", ["counted", "one"], ["size"]),
        helper.make_node(operator, ["late", "size"], ["harmed"]),
    ]


def _loop_s(shape: tuple[int, ...]) -> float:
    """How long TRIED rounds of the loop take here."""
    options = ort.SessionOptions()
    options.intra_op_num_threads = 1
    session = ort.InferenceSession(_policy(shape, _loop(TRIED)), options, providers=["CPUExecutionProvider"])
    late = np.ones((1, *shape), dtype=np.float32)
    start = time.perf_counter()
    session.run(None, {"observation": late})
    return time.perf_counter() - start
