"""Workspaces that wait for agents, networks of the paper, and networks as other people export them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from galley.agents.admission.adding import Added, Convert, Newcomer, add_network, as_it_is
from galley.learning.bundles.described_network import KNOWN, described_onnx
from galley.learning.bundles.onnx_adapting import conform
from galley.workspace import Workspace
from tests.agents.policies import FEATURES

ROOM = """\
format: 1
title: {name}
aliases: [{alias}]
source: drawn for a test
rules: {{rule_set: classic, cook_time_ticks: 20, delivery_reward: 20, horizon_ticks: 400}}
grid: |
  XXPXX
  O  2O
  X1  X
  XDXSX
"""


def workspace(folder: Path) -> Workspace:
    """A workspace with the layouts `room` (alias `hall`) and `den`, and no agents."""
    (folder / "layouts").mkdir(parents=True)
    for name, alias in (("room", "hall"), ("den", "lair")):
        text = ROOM.format(name=name, alias=alias)
        (folder / "layouts" / f"{name}.yaml").write_text(text, encoding="utf-8")
    return Workspace(folder)


def cole_weights(shape: tuple[int, ...], seed: int = 0) -> dict[str, np.ndarray]:
    """Random weights of the paper's network for observations [C, H, W], named as PyTorch names them."""
    random = np.random.default_rng(seed)
    channels, height, width = shape
    sizes = [(25, channels, 5, 5), (25, 25, 3, 3), (25, 25, 3, 3)]
    sizes += [(64, 25 * (height - 2) * (width - 2)), (64, 64), (64, 64), (6, 64)]  # type: ignore[list-item]
    made: dict[str, np.ndarray] = {}
    for place, size in enumerate(sizes):
        scale = np.sqrt(2 / np.prod(size[1:]))
        made[f"net.{place}.weight"] = (random.normal(size=size) * scale).astype(np.float32)
        made[f"net.{place}.bias"] = (random.normal(size=size[0]) * 0.1).astype(np.float32)
    return made


def cole_policy(shape: tuple[int, ...], seed: int = 0) -> bytes:
    """The paper's network with random weights."""
    return described_onnx(KNOWN["cole-cnn"], cole_weights(shape, seed), shape)


def foreign(
    *,
    given: str = "action_logits",
    batch: int | str = "N",
    softmax: bool = False,
    value_head: bool = False,
    hidden_softmax: bool = False,
    kind: int = TensorProto.FLOAT,
    opset: int = 11,
    flatten_to: list[int] | None = None,
    rank_one: bool = False,
) -> bytes:
    """A linear policy on the features of 2019 with names, types and shapes as others choose them."""
    random = np.random.default_rng(3)
    constants = [
        numpy_helper.from_array((random.normal(size=(62, 6)) * 0.2).astype(np.float32), "w"),
        numpy_helper.from_array((random.normal(size=(62, 1)) * 0.2).astype(np.float32), "v"),
        numpy_helper.from_array(np.array(flatten_to or [1, 62], dtype=np.int64), "flat"),
    ]
    nodes = [helper.make_node("Cast", ["obs"], ["seen"], to=TensorProto.FLOAT)]
    value = "seen"
    if flatten_to is not None:
        nodes.append(helper.make_node("Reshape", [value, "flat"], ["reshaped"]))
        value = "reshaped"
    ends = softmax or hidden_softmax
    nodes.append(helper.make_node("MatMul", [value, "w"], ["scores" if ends else given]))
    if softmax:
        nodes.append(helper.make_node("Softmax", ["scores"], [given], axis=1))
    if hidden_softmax:  # the exponentials and their sum, as some write it by hand
        nodes += [
            helper.make_node("Exp", ["scores"], ["weights"]),
            helper.make_node("ReduceSum", ["weights"], ["sum"], axes=[1], keepdims=1),
            helper.make_node("Div", ["weights", "sum"], [given]),
        ]
    shape = [62] if rank_one else [batch, 62]
    outputs = [helper.make_tensor_value_info(given, TensorProto.FLOAT, None)]
    if value_head:
        nodes.append(helper.make_node("MatMul", [value, "v"], ["value"]))
        outputs[0] = helper.make_tensor_value_info(given, TensorProto.FLOAT, [batch, 6])
        outputs.append(helper.make_tensor_value_info("value", TensorProto.FLOAT, [batch, 1]))
    graph = helper.make_graph(
        nodes, "foreign", [helper.make_tensor_value_info("obs", kind, shape)], outputs, constants
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], ir_version=6)
    return bytes(model.SerializeToString())


def mended(path: Path, shape: tuple[int, ...]):  # type: ignore[no-untyped-def]
    """The converter of the command line."""
    try:
        return as_it_is(path, shape)
    except Exception:
        return conform(path, shape)


def let_in(
    place: Workspace,
    files: dict[str, Path],
    *,
    convert: Convert = as_it_is,
    name: str = "guest",
    encoding: str = FEATURES,
    replace: bool = False,
) -> Added:
    """What comes of asking to let an agent in."""
    new = Newcomer(name, files, encoding, command="galley agents add ...")
    return add_network(place, new, convert, replace=replace)


def reread(content: bytes) -> onnx.ModelProto:
    """The model in a file's bytes, checked."""
    model = onnx.load_model_from_string(content)
    onnx.checker.check_model(model)
    return model
