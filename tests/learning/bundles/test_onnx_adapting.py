"""Networks that other people exported answer the same after they were made to fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import onnxruntime as ort
import pytest
from onnx import TensorProto, helper

from galley.errors import GalleyError
from galley.learning.bundles.onnx_adapting import conform
from tests.agents.admission.newcomers import cole_policy, foreign, reread
from tests.agents.policies import linear_policy, model, summing_policy

SHAPE = (62,)
SEEN = np.random.default_rng(5).integers(0, 4, (7, 62)).astype(np.float32)


def answers(content: bytes, seen: np.ndarray = SEEN) -> np.ndarray:
    session = ort.InferenceSession(content, providers=["CPUExecutionProvider"])
    return np.asarray(session.run(["logits"], {"observation": seen})[0])


def shares(logits: np.ndarray) -> np.ndarray:
    weights = np.exp(logits - logits.max(axis=1, keepdims=True))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


PLAIN = SEEN @ (np.random.default_rng(3).normal(size=(62, 6)) * 0.2).astype(np.float32)

CASES = [
    ({}, "'obs' renamed to 'observation'; 'action_logits' renamed to 'logits'"),
    ({"given": "logits"}, "'obs' renamed"),
    ({"batch": 1}, "the fixed batch of 1 opened"),
    ({"batch": 1, "flatten_to": [1, 62]}, "the fixed batch of 1 opened"),
    ({"batch": 1, "flatten_to": [-1, 62]}, "the fixed batch of 1 opened"),
    ({"rank_one": True, "flatten_to": [1, 62]}, "observations are run one after the other"),
    ({"flatten_to": [1, 62]}, "observations are run one after the other"),
    ({"softmax": True}, "the softmax at the end taken off"),
    ({"softmax": True, "given": "logits"}, "the softmax at the end taken off"),
    ({"hidden_softmax": True}, "the logarithm of the probabilities taken"),
    ({"hidden_softmax": True, "batch": 1}, "the logarithm of the probabilities taken"),
    ({"value_head": True}, "outputs dropped: value"),
    ({"kind": TensorProto.DOUBLE}, "renamed"),
    ({"kind": TensorProto.UINT8}, "renamed"),
    ({"opset": 8}, "operator set 8 brought to 17"),
    ({"opset": 7, "softmax": True}, "operator set 7 brought to 17; "),
    ({"opset": 9, "batch": 1}, "the fixed batch of 1 opened"),
]


@pytest.mark.parametrize(("made", "told"), CASES)
def test_answers_stay_the_same(made: dict[str, object], told: str) -> None:
    done = conform(foreign(**made), SHAPE)  # type: ignore[arg-type]
    assert told in "; ".join(done.notes)
    found = reread(done.content)
    assert [one.name for one in found.graph.input] == ["observation"]
    assert [one.name for one in found.graph.output] == ["logits"]
    for size in (1, 3, 7):
        assert np.allclose(shares(answers(done.content, SEEN[:size])), shares(PLAIN[:size]), atol=1e-5)


def test_logits_are_kept_as_they_are_also_below_a_softmax() -> None:
    assert np.allclose(answers(conform(foreign(softmax=True), SHAPE).content), PLAIN, atol=1e-5)


def test_a_network_that_fits_is_changed_in_nothing_that_counts() -> None:
    policy = linear_policy()
    done = conform(policy, SHAPE)
    assert done.notes == ()
    assert np.array_equal(answers(done.content), answers(policy))


def test_a_batch_that_is_wrong_inside_is_not_opened() -> None:
    # The second half of the network mixes all rows, which only a batch of 1 bears.
    nodes = [
        helper.make_node("ReduceMean", ["x"], ["mean"], axes=[0], keepdims=1),
        helper.make_node("Gemm", ["mean", "w", "b"], ["y"]),
        helper.make_node("Sub", ["x6", "x6"], ["zero"]),
        helper.make_node("Add", ["y", "zero"], ["z"]),
    ]
    nodes.insert(0, helper.make_node("Gemm", ["x", "w", "b"], ["x6"]))
    random = np.random.default_rng(1)
    parts = {"w": random.normal(size=(62, 6)).astype(np.float32), "b": np.ones(6, dtype=np.float32)}
    fixed = model(nodes, {"x": [1, 62]}, {"z": [1, 6]}, parts)
    done = conform(fixed, SHAPE)
    assert "run one after the other" in done.notes[-1]
    assert np.allclose(answers(done.content), SEEN @ parts["w"] + 1, atol=1e-4)


def test_weights_beside_the_file_are_taken_into_it(tmp_path: Path) -> None:
    shape = (26, 4, 5)
    whole = onnx.load_model_from_string(cole_policy(shape))
    path = tmp_path / "far.onnx"
    onnx.save(whole, path, save_as_external_data=True, location="far.data", size_threshold=0)
    assert (tmp_path / "far.data").stat().st_size > 100_000
    done = conform(path, shape)
    seen = np.random.default_rng(0).integers(0, 2, (3, *shape)).astype(np.float32)
    assert np.array_equal(answers(done.content, seen), answers(cole_policy(shape), seen))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"nothing", "not ONNX that can be read"),
        (linear_policy(features=20), r"input 'observation' has shape \['B', 20\], not \['B', 62\]"),
        (
            linear_policy(outputs=5),
            r"output 'logits' has 5 numbers for one observation \(shape \[1, 5\]\), not 6",
        ),
        (foreign(batch=8), r"has shape \[8, 62\].*a fixed batch can be opened if it is 1"),
        (summing_policy(), "with memory also state_in and state_out"),
    ],
)
def test_what_cannot_fit_is_told(content: bytes, message: str) -> None:
    with pytest.raises(GalleyError, match=message):
        conform(content, SHAPE)
